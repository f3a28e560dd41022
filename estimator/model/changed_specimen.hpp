#pragma once
// Any specimen with what field effects change (estimator/effects/field_model.hpp), beside the annulus of gel that affected_model.hpp
// builds. The mesh stays that of the study.
//
//   inclusion         the law's energy times a factor that depends on the place
//   added fibres      the law with one more family (reinforced_law.hpp), at an angle to the fibres or, without, to the circumference
//   turned fibres     material axes turned about the wall's normal by  turn + course (1 - 2 depth)
//   residual stress   F_elastic = F G, det G = 1 (effects/residual_stress.cpp): the axes are stretched
//
// The rest of it only shows in images or in the pressures that are read: changed_motion.hpp (estimator/fit).

#include <memory>
#include <vector>

#include "estimator/effects/effect.hpp"
#include "estimator/model/inclusion_stiffness.hpp"
#include "estimator/model/study_model.hpp"

namespace diastole {

class ChangeableSpecimen {
 public:
  /// Throws InputError as make_model does. The study's own effects are left out. `findings` as study_body's.
  explicit ChangeableSpecimen(Study study, std::vector<Finding>* findings = nullptr);

  [[nodiscard]] const HermiteMesh& mesh() const { return parts_->body.mesh; }
  /// Whether it can have that effect.
  [[nodiscard]] bool takes(const Effect& effect) const;
  /// Those that it can have, in the list's order.
  [[nodiscard]] std::vector<const Effect*> effects() const;

  /// The law's parameters at their starts.
  [[nodiscard]] ElasticModel with(const FieldModel& change, const SolveOptions& options = {}) const;

 private:
  std::shared_ptr<const SpecimenParts> parts_;
  std::shared_ptr<const InclusionStiffness> stiffness_;
  std::shared_ptr<const std::vector<double>> depths_;  // of the nodes
};

/// The changes of a study's effects at the values stated there. Throws InputError for one that the specimen cannot have.
FieldModel specimen_change_of(const Study& study);

}  // namespace diastole
