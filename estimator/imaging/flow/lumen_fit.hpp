#pragma once
// The scene of a lumen (lumen_model.hpp) and its velocity profile in every phase, fitted to magnitudes and phases together by Gauss-Newton:
//
//   minimise  sum over phases and pixels of (M / s_p)^2 wrap(phase - model)^2 + ((M - model) / s_m)^2
//
// with s_m the noise of the magnitude and s_p that of magnitude x phase. Phases are compared within half a turn, so that nothing in the image is unwrapped; which turn the fluid's
// core has is given, and tried by its neighbours.

#include <Eigen/Dense>
#include <vector>

#include "estimator/imaging/flow/lumen_model.hpp"
#include "estimator/imaging/flow/moving_fluid.hpp"

namespace diastole::imaging {

struct LumenData {
  SlicePlane plane;
  std::vector<Image> magnitude;
  std::vector<Image> phase_rad;  ///< background taken off
  PhaseNoise noise;
  Eigen::Vector2d measured_share = {1, 1};  ///< of the spectrum's lines, along rows and along columns
  double cm_s_per_radian = 0;
};

struct LumenFit {
  LumenScene scene;
  Encoding encoding = Encoding::separate;
  bool converged = false;
  double reduced_chi_square = 0;
  double velocity_chi_square = 0;         ///< of the phases alone, without the magnitudes; reduced, too
  std::vector<double> phase_chi_square;   ///< of each phase, reduced
  std::vector<Eigen::VectorXd> profiles;  ///< of each phase, radians
  std::vector<LumenShape> shapes;         ///< of each phase: one and the same unless it moves
  bool moves = false;
  double movement_mm = 0;  ///< of the centre over the cycle, RMS
  double area_mm2 = 0;
  std::vector<double> core_cm_s;  ///< the fastest of each phase's profile
  Eigen::VectorXd flow_mL_s;
  Eigen::MatrixXd covariance;  ///< of the flow: noise and what the scene is uncertain by
  /// Chi-square of the best fit with a turn more or less of the core over this one's, in units of its own; small where the images do not fix the turn.
  std::vector<double> turn_margin;

  /// Of images that the scene explains: what it does not hold has less than half of the noise's variance. Labelled tubes leave 0.98 to 1.03,
  /// drawn ones that move by pixels 1.2 to 1.4.
  static constexpr double most_chi_square = 1.5;
  [[nodiscard]] bool describes_images() const { return converged && reduced_chi_square < most_chi_square; }
};

struct LumenStart {
  LumenScene scene;                       ///< of about its mean place and size, within the image
  std::vector<Eigen::Vector2d> moved_mm;  ///< of each phase from that place; empty: at rest
  std::vector<double> core_rad;           ///< the fastest fluid of each phase, with whole turns
};

LumenFit fit_lumen(const LumenData& data, const LumenStart& start);

}  // namespace diastole::imaging
