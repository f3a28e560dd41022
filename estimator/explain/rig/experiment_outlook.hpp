#pragma once
// What a segment, if it were run, would show about competing models: predictions, their derivatives, and the sums of
// squares that a linearised refit needs.
//
// Of two models A and B the segment's whitened residuals, if A is true, are r = W (y_A - y_B); B's unknowns adapt by
// theta with the columns K = W dy_B/dtheta, the sensors' zeros of a new run by two more with a prior of 30 Pa, and the
// cycles' sizes are taken off along W y_A, and what the model's own error may be in the segment (harmonics of the cycle, sizes
// as in estimator/rig_fit/model_error.hpp) is taken off too. Rows of several segments add, so that only Gram matrices [r K]' [r K] are kept,
// one a channel. What is left is their inference::separation d, with what the session's own data say of B's unknowns known beforehand.
//
// A real refit also bends: from some ten sigma on d is too large, by up to a half. The choice suffers little.

#include <Eigen/Dense>
#include <array>
#include <vector>

#include "estimator/explain/rig/effect_sets.hpp"
#include "estimator/explain/rig/trial_run.hpp"

namespace diastole::explain {

/// What may be measured in a segment: cavity pressure, pump-end pressure, gated cavity volumes; and once beside them:
/// the inner radius in an image of the specimen at rest, C1 by a rotational shear test.
enum class Observable : size_t { cavity, pump, volume, radius, stiffness };
inline constexpr size_t measured_count = 3;  ///< in a segment
using Equipment = std::array<bool, 5>;

/// What one segment shows of all models. Indices: [true model][adapting model][channel].
struct SegmentOutlook {
  std::vector<std::vector<std::array<Eigen::MatrixXd, measured_count>>> gram;

  /// The sum over the channels of the equipment.
  [[nodiscard]] Eigen::MatrixXd of(size_t truth, size_t adapting, const Equipment& equipment) const;
};

/// A fitted set as experiments see it: the effects' values, the modulus and the sensors' offsets; tolerances stay.
struct FittedModel {
  rig::SessionModel model;
  std::vector<rig::Unknown> unknowns;  ///< the effects'; then ln modulus and offsets in sds
  Eigen::VectorXd coordinates;
  Eigen::MatrixXd covariance;  ///< by the session's data, whatever the tolerances are
  std::vector<double> errors;  ///< of the effects' values

  /// With one coordinate moved by its perturbation; `step`: by how much.
  [[nodiscard]] rig::SessionModel moved(Eigen::Index unknown, double& step) const;
};
FittedModel fitted_model(const rig::SessionProblem& problem, const EffectSet& set);

/// The information P of a fit's session about its unknowns and the new run's two zeros.
Eigen::MatrixXd known_before(const FittedModel& fit);

/// What the session can measure already.
Equipment equipment_of(const rig::Session& session);

SegmentOutlook look_ahead(const rig::SessionProblem& problem, const std::vector<const FittedModel*>& models,
                          const runfile::Segment& segment);

/// How exact the measurements beside are.
struct SpecimenKnowledge {
  double inner_radius_mm = 0.0;      ///< 0: the specimen has none
  double radius_error_mm = 0.2;      ///< a quarter of the paper's pixel of 0.8 mm: an edge seen all around
  double relative_C1_error = 0.007;  ///< of a rotational shear test
};

/// What they add to a sum of Gram matrices. C1 counts only if neither model's stiffness depends on time.
Eigen::MatrixXd gram_beside(const rig::SessionProblem& problem, const FittedModel& truth,
                            const FittedModel& adapting, const Equipment& equipment,
                            const SpecimenKnowledge& knowledge);

}  // namespace diastole::explain
