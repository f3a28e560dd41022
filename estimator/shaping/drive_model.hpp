#pragma once
// What the rig's model makes of a periodic drive: the curve of the specimen's volume, averaged over the cycles that are
// looked at, as gated imaging averages them. Times are those of the wanted curve: a cycle of the pump begins where its
// drive is least.

#include <memory>
#include <span>

#include "estimator/effects/effect_library.hpp"
#include "estimator/io/study.hpp"
#include "estimator/model/session.hpp"
#include "estimator/model/specimen_family.hpp"
#include "estimator/rig/simulation.hpp"
#include "estimator/shaping/periodic_curve.hpp"

namespace diastole::shaping {

/// How a drive is played, and which of its cycles count.
struct CyclePlan {
  double rest_s = 1.0;
  size_t cycles = 12;
  size_t settling = 3;  ///< first cycles, in which the motion sets in
};

struct ModelResponse {
  PeriodicCurve cavity_mL;    ///< taken by the specimen since rest
  double greatest_kPa = 0.0;  ///< that the specimen holds in the run
  double left_mL = 0.0;  ///< in the specimen when the piston is home again; below 0: what has leaked away
};

/// An effect of the plant that runs can teach, with its present values.
struct LearnableEffect {
  const Effect* effect = nullptr;
  std::vector<double> values;
};

class DriveModel {
 public:
  /// A run at this place in its session, with a rig that has these effects, the library's, beside those applied already.
  DriveModel(rig::RigModel base, std::shared_ptr<const rig::SpecimenCurves> curves, EffectLibrary library,
             std::vector<LearnableEffect> effects, rig::RunPlace place, const CyclePlan& plan);
  /// The same rig with other values of its effects, in their order.
  [[nodiscard]] DriveModel with_values(std::span<const double> values) const;
  [[nodiscard]] const std::vector<LearnableEffect>& effects() const { return effects_; }

  /// With as many harmonics as `harmonics`.
  [[nodiscard]] ModelResponse response(const PeriodicCurve& drive_mL, Eigen::Index harmonics) const;
  /// Derivatives of the volume by the drive, both as numbers_of(): so many rows as columns.
  [[nodiscard]] Eigen::MatrixXd jacobian(const PeriodicCurve& drive_mL) const;
  /// The drive whose modelled volume is this curve's, with the harmonics of `start`, from which it is sought; the nearest that was found.
  [[nodiscard]] PeriodicCurve inverse(const PeriodicCurve& cavity_mL, const PeriodicCurve& start) const;

  [[nodiscard]] const rig::RigModel& model() const { return model_; }
  [[nodiscard]] const rig::RunPlace& place() const { return place_; }
  [[nodiscard]] const CyclePlan& plan() const { return plan_; }

 private:
  rig::RigModel base_;
  std::shared_ptr<const rig::SpecimenCurves> curves_;
  EffectLibrary library_;  // owns those of a user's files
  std::vector<LearnableEffect> effects_;
  rig::RigModel model_;  ///< with the effects
  rig::RunPlace place_;
  CyclePlan plan_;
};

/// The effects of the library that may be learned: of the plant, at no moment, in a specimen that keeps its modulus. At their neutral
/// values for this rig.
std::vector<LearnableEffect> learnable_effects(const EffectLibrary& library, const rig::RigModel& base);

/// How far the study's specimen can be filled: to this volume, or to the one at which it holds this pressure (SpecimenFamily::reach). A volume
/// up to which its curve is solved for in any case is taken as reached; the pressure is 0 then.
rig::SpecimenReach specimen_reach(const Study& study, double volume_mL, double pressure_kPa);

/// The rig, specimen and effects of a study, for a run after its session, with a specimen's curve that holds up to `largest_mL`.
/// Throws InputError if the study names no runs, or as read_session.
DriveModel drive_model_of(const Study& study, double largest_mL, const CyclePlan& plan);

/// Root of the mean square of a - b over a period; harmonics that one lacks are zero.
double rms_between(const PeriodicCurve& a, const PeriodicCurve& b);

}  // namespace diastole::shaping
