#pragma once
// A linear Gaussian fit of something that is seen in several phases: what all phases have in common, how each departs
// from it, and the sizes of all that by evidence.
//
//   y_p = C_p z + D_p d_p + noise,   noise ~ N(0, scale^2),  z_i ~ N(0, v_z[i]),  d_pj ~ N(0, v_d[j])
//
// z is common, d_p the departure of phase p from the first of them: D_p are the first columns of C_p, or none.
// Variances are infinite where nothing is known.
// The posterior is exact (departures are eliminated phase by phase). Who calls it sets variances and noise from
// `square_of_common`, `square_of_departures` and `noise_square`: the expectation step of EM (Dempster, Laird, Rubin 1977),
// whose fixed point is the largest evidence.

#include <Eigen/Dense>
#include <vector>

namespace diastole::imaging {

/// One phase's equations, divided by the standard deviations of their noise.
struct PhaseEquations {
  Eigen::MatrixXd common;  ///< C
  Eigen::VectorXd y;
};

struct PhasedPrior {
  Eigen::VectorXd common_variance;  ///< infinity: not known
  Eigen::VectorXd departure_variance;
  double noise_variance = 1;  ///< factor on the equations' own
};

class PhasedFit {
 public:
  /// `departures`: how many columns D has.
  PhasedFit(const std::vector<PhaseEquations>& equations, Eigen::Index departures);

  /// Precondition: data and prior together determine everything.
  void solve(const PhasedPrior& prior);

  [[nodiscard]] const Eigen::VectorXd& common() const { return common_; }
  [[nodiscard]] const Eigen::MatrixXd& common_covariance() const { return common_covariance_; }
  [[nodiscard]] const Eigen::VectorXd& departure(size_t phase) const { return phases_[phase].departure; }
  /// Expected squares, given the data.
  [[nodiscard]] Eigen::VectorXd square_of_common() const;
  /// Likewise, summed over the phases.
  [[nodiscard]] const Eigen::VectorXd& square_of_departures() const { return departure_squares_; }
  /// Expected sum of squared noise in units of the equations' own sigmas.
  [[nodiscard]] double noise_square() const { return noise_square_; }
  [[nodiscard]] Eigen::Index rows() const { return rows_; }
  /// RMS over a phase's equations of C z, for the first unknowns z; in the equations' own sigmas.
  [[nodiscard]] double rms_of(size_t phase, const Eigen::VectorXd& common) const;
  /// Covariance of T z + U d_p.
  [[nodiscard]] Eigen::MatrixXd covariance(size_t phase, const Eigen::MatrixXd& of_common,
                                           const Eigen::MatrixXd& of_departure) const;

 private:
  struct Phase {
    Eigen::MatrixXd cc;  // C'C, whose first rows are D'C
    Eigen::VectorXd cy;
    double yy = 0, rows = 0;
    Eigen::MatrixXd inverse;  // (D'D / scale^2 + 1 / v_d)^-1
    Eigen::MatrixXd gain;     // inverse D'C / scale^2
    Eigen::VectorXd departure;
  };
  Eigen::Index departures_;
  std::vector<Phase> phases_;
  Eigen::Index rows_ = 0;
  Eigen::VectorXd common_;
  Eigen::MatrixXd common_covariance_;
  Eigen::VectorXd departure_squares_;
  double noise_square_ = 0;
};

}  // namespace diastole::imaging
