#pragma once
// The forward model of a study whose [model] names effects that show in images (field_model.hpp), at the values stated
// there: what `solve`, `pv` and `fit` use of explained.study.toml. Effects of the rig alone leave the specimen as it is.

#include "estimator/effects/field_model.hpp"
#include "estimator/fe/elastic_model.hpp"
#include "estimator/io/finding.hpp"
#include "estimator/io/study.hpp"

namespace diastole {

/// The study's specimen with its effects. Throws InputError for an effect that does not exist. Precondition: an annulus.
FieldModel field_model_of(const Study& study);

/// Law and options for a mesh of the model's geometry, tolerances left to the caller.
struct FieldElasticity {
  const Law* law;
  ElasticOptions options;
};
FieldElasticity elasticity_of(const FieldModel& model, const HermiteMesh& mesh, double C1_kPa);

/// Whether the study's specimen is that annulus: neo-Hookean, with held ends and no [chamber].
bool is_gel(const Study& study);

/// make_model (estimator/model/study_model.hpp) with the study's effects: those of gel, or those of any other specimen
/// (changed_specimen.hpp). Throws InputError besides if the specimen cannot have them. `findings` gets those of model_findings, without
/// another fit of measured fibres (which the callers of `unload` and of a fit's motion do make).
ElasticModel make_affected_model(const Study& study, SolveOptions options = {},
                                 std::vector<Finding>* findings = nullptr);

/// Whether one of the study's effects does.
bool shows_in_images(const Study& study);

/// What of the study its specimen's mechanics does not take as it may be meant: effects that are one of its pressures alone, fibres
/// that are another's.
std::vector<Finding> model_findings(const Study& study);

/// What the study's effects change; the base model where none of them shows in images.
FieldModel field_change_of(const Study& study);

}  // namespace diastole
