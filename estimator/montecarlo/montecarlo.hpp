#pragma once
// How precisely a study's design determines its parameters: synthetic data with known values are refitted many times
// (Augenstein et al. 2005, Table 1: noise levels by numbers of frames).
//
// The truth is the study's start values and its frames' measured pressures; the points are the study's own, or those
// of a tag grid (synthetic_data.hpp). With `unload` it is a body whose shape was imaged at the study's imaged_at_kPa, and each refit
// finds the shape without load from a reading of that pressure with an error of its own. A cell is one refit; cells of equal noise
// and number of frames make an entry of the table. Repeat 0 is fitted to data without noise, its size being stated nevertheless: its
// standard errors are the Cramér–Rao bound of the design, below which no unbiased estimator's can be.

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimator/io/measurement.hpp"
#include "estimator/io/study.hpp"
#include "estimator/montecarlo/synthetic_data.hpp"

namespace diastole {

struct MonteCarloPlan {
  std::vector<double> noise_mm = {0.0};  ///< 0: each point's stated sigma
  std::vector<int> frames;               ///< how many loaded frames
  int repeats = 10;
  bool exact_pressures = false;
  unsigned seed = 1;
  bool unload = false;               ///< as the fit's (study_fit.hpp)
  std::optional<TagGrid> grid = {};  ///< instead of the study's own points
};

struct Cell {
  double noise_mm;
  int frames;
  int repeat;  ///< 1, 2, ...; 0 without noise
  friend bool operator==(const Cell&, const Cell&) = default;
};

struct CellResult {
  Cell cell{};
  bool converged = false;
  int iterations = 0;
  double seconds = 0;
  std::vector<double> value;  ///< of each parameter of the study; regional ones by their mean
  std::vector<double> se;
};

/// Repeats outermost, so that an interrupted table is even.
std::vector<Cell> cells_of(const MonteCarloPlan& plan);

/// Makes and refits cells. The same cell has the same data in every process.
class CellFitter {
 public:
  /// Solves the truth. Throws InputError if it has no equilibrium, or if the plan asks for frames that are not there.
  CellFitter(const Study& study, const Measurement& design, const MonteCarloPlan& plan);
  ~CellFitter();

  [[nodiscard]] CellResult fit(const Cell& cell);
  [[nodiscard]] size_t points() const;  ///< tag points and 3-D points of all frames

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct ParameterSpread {
  std::string name;
  double truth;
  double mean;
  double sd;
  double sd_percent;           ///< of the mean, as in Table 1
  std::array<double, 2> ci95;  ///< mean ± 1.96 sd: the paper's confidence interval
  double mean_se;              ///< what the refits say of themselves
  double coverage;             ///< share of refits whose own 95 % interval holds the truth
  double bound;                ///< Cramér–Rao: the standard error of repeat 0; NaN without one
};

struct TableEntry {
  double noise_mm;
  int frames;
  int refits;  ///< that converged
  int failed;
  std::vector<ParameterSpread> parameters;
};

/// One entry for each noise and number of frames of the plan, in its order. Coverage takes a positive parameter's
/// interval as a factor, as the fit does.
std::vector<TableEntry> table_of(const MonteCarloPlan& plan, const Study& study,
                                 const std::vector<CellResult>& results);

// Table 1 of Augenstein et al. (J. Biomech. Eng. 127 (2005) 148): standard deviations of C, b1, b2, b3 of the paper's Eq. 5,
// in % of their mean, over ten refits of 3-D points with so much noise in so many frames.

/// C, b1, b2, b3 for one of the table's noises (0.4, 0.8, 1.6, 3.2 mm) and numbers of frames (1, 3, 5).
std::optional<std::array<double, 4>> paper_sd_percent(double noise_mm, int frames);

}  // namespace diastole
