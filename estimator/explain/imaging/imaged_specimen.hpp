#pragma once
// What an explanation asks of a specimen whose motion was imaged: its base model and the effects it can have, fitted to the motion.
// GelSpecimen is the neo-Hookean annulus between held plates, on meshes of its own; AnySpecimen what a study describes, on the study's mesh.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "estimator/explain/imaging/field_hypotheses.hpp"
#include "estimator/explain/imaging/field_modes.hpp"
#include "estimator/explain/verdict/explanation.hpp"
#include "estimator/io/study.hpp"

namespace diastole::explain {

/// Called with what is being done; whatever it throws ends the work.
using FieldProgress = std::function<void(const std::string&)>;

class ImagedSpecimen {
 public:
  virtual ~ImagedSpecimen() = default;

  /// Throws InputError where the base model has no equilibrium. All else wants it first.
  virtual void fit_base() = 0;
  /// Multiplies the tags' sigmas; the base is to be fitted again.
  virtual void widen_sigmas(double factor) = 0;

  [[nodiscard]] virtual const FieldCase& field() const = 0;
  /// The rows that all fits of effects share.
  [[nodiscard]] virtual const MotionResiduals& rows() const = 0;
  /// Those rows' undeformed mesh.
  [[nodiscard]] virtual const HermiteMesh& mesh() const = 0;
  /// Of those rows: what effects are compared with.
  [[nodiscard]] virtual const FieldFit& base() const = 0;
  /// Of the modes' rows: what structure is looked for in. Its mesh may be a finer one.
  [[nodiscard]] virtual const FieldFit& base_of_structure() const { return base(); }
  [[nodiscard]] virtual FieldModes modes() = 0;
  /// What the mesh may gain of chi2 by itself.
  [[nodiscard]] virtual double mesh_error() const { return 0.0; }

  [[nodiscard]] virtual std::vector<FieldHypothesis> singles() = 0;
  /// `singles`: best first. Joint fits, best first.
  [[nodiscard]] virtual std::vector<FieldHypothesis> pairs(const std::vector<FieldHypothesis>& singles) = 0;

  /// Fits what is to be named once more, with the mesh's own error as it is with the effects.
  virtual void settle(FieldHypothesis& /*hypothesis*/) {}

  /// How the law's values change with the effects.
  [[nodiscard]] virtual std::vector<ParameterShift> shifts(const FieldFit& after) const = 0;
  /// What the cavity takes at the highest pressure; NaN where that is not known.
  [[nodiscard]] virtual double volume_change_mL(const FieldHypothesis& hypothesis) = 0;
};

std::unique_ptr<ImagedSpecimen> gel_specimen(FieldCase field, std::string study_file);
/// Throws InputError for a study that cannot be explained.
std::unique_ptr<ImagedSpecimen> any_specimen(const Study& study, const FieldProgress& progress = {});

}  // namespace diastole::explain
