#pragma once
// What a model's mesh gets wrong: the motion on a mesh of twice as many elements each way, less that on its own, at the same values and
// pressures. Added to the residuals of another search (JointProblem::set_correction) it gives the estimate of the finer mesh for one
// solution on it (defect correction; K. Böhmer, P. W. Hemker, H. J. Stetter, Computing Suppl. 5, 1984).

#include <Eigen/Dense>
#include <memory>
#include <optional>
#include <span>

#include "estimator/fit/elastic_motion.hpp"
#include "estimator/io/study.hpp"
#include "estimator/motion_residuals/motion_residuals.hpp"

namespace diastole {

/// The study on twice as many elements each way: an annulus or an ellipsoid approximated anew, another body halved. Precondition: no
/// parameter varies by element.
Study on_finer_mesh(Study study);

/// What is left of a mesh's error by then, as a part of the correction, is at most this: that of a solution that converges in second order.
inline constexpr double error_left_on_finer_mesh = 1.0 / 3.0;

/// Motions at the same values on two meshes, one a slot.
struct CoarseMotions {
  const HermiteMesh& mesh;
  std::span<const NodeField> position_mm;
  std::span<const double> values;
  std::span<const double> pressures_kPa;
};

/// Changes of `rows`, which are of the coarse mesh; places outside the finer one change nothing. Nothing without an equilibrium.
std::optional<Eigen::VectorXd> finer_mesh_correction(MotionModel& finer, const CoarseMotions& coarse,
                                                     const MotionResiduals& rows, LocatorOptions locator);

}  // namespace diastole
