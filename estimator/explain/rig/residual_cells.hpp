#pragma once
// Whitened residuals tested cell by cell: where does their square exceed what noise and the model's error leave?
//
// Five kinds of cells of each channel of each run:
//   scatter   a segment's phase bin, over all cycles: sum r^2
//   shape     the same bin of the mean cycle: what repeats in every cycle, and averages out of the noise
//   cycles    the means of whole cycles: drift, steps, softening
//   rest      before, between and after the cycles, in seconds
//   band      of the run's spectrum
// Under the null each is a chi-square of as many degrees of freedom as it has residuals, its scale known within the
// noise's own uncertainty; p-values are corrected for the number of cells.

#include <Eigen/Dense>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "estimator/rig_fit/rig_fit.hpp"

namespace diastole::explain {

enum class CellKind { scatter, shape, cycles, rest, band, volume };

struct ResidualCell {
  CellKind kind = CellKind::scatter;
  size_t run = 0;
  std::string channel;
  std::optional<int> segment;
  std::optional<std::array<double, 2>> phase;
  std::optional<std::array<double, 2>> band_Hz;
  double chi_square = 0.0;  ///< over noise and model error
  double dofs = 0.0;
  double p_value = 1.0;

  [[nodiscard]] double excess() const { return chi_square - dofs; }
};

inline constexpr size_t phase_bins = 10;
inline constexpr double noise_uncertainty =
    0.04;  ///< relative, of variances estimated from some seconds of rest

/// `variance`: of the model's error (tolerance.hpp), one a residual.
std::vector<ResidualCell> residual_cells(const rig::Session& session,
                                         const std::vector<rig::ResidualBlock>& blocks,
                                         const Eigen::VectorXd& residuals, const Eigen::VectorXd& variance);

/// Those beyond chance at a false discovery rate, the largest excess first.
std::vector<ResidualCell> significant(std::vector<ResidualCell> cells, double rate);

/// Whether cells that stand out are more than a known model leaves: one is beyond chance so far that the number of all
/// cells does not matter (Holm at 1e-6).
bool is_structured(const std::vector<ResidualCell>& left, size_t cells);

}  // namespace diastole::explain
