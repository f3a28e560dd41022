#include "estimator/model/affected_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimator/io/study_refusal.hpp"
#include "estimator/model/changed_specimen.hpp"
#include "estimator/model/inclusion_stiffness.hpp"
#include "estimator/model/study_effects.hpp"
#include "estimator/model/study_model.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole {
namespace {

/// Fibres on cylinders about z, at an angle from the circumference towards z.
MaterialAxesField helical_axes(double angle_deg) {
  const double angle = angle_deg * rad_per_deg;
  return [angle](const HermiteMesh& mesh, const MaterialPoint& point) {
    const Eigen::Vector3d X_mm = mesh.value(mesh.reference(), point);
    const Eigen::Vector3d outwards = Eigen::Vector3d(X_mm[0], X_mm[1], 0.0).normalized();
    const Eigen::Vector3d around(-outwards[1], outwards[0], 0.0);
    const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
    MaterialAxes axes;
    axes << std::cos(angle) * around + std::sin(angle) * up, std::cos(angle) * up - std::sin(angle) * around,
        outwards;
    return axes;
  };
}

/// Both ends kept in their planes by the plates, and on springs across z.
void let_ends_slip(const HermiteMesh& mesh, double stiffness_kPa_per_mm, ElasticOptions& options) {
  HeldDofs held = hold_nothing(mesh);
  for (const auto* faces : {&mesh.faces().bottom, &mesh.faces().top}) {
    hold_face_component(mesh, *faces, 2, held);
    options.bonded.push_back({*faces, {0.0, stiffness_kPa_per_mm}});
  }
  options.held = std::move(held);
}

bool is_of_gel(const Effect& effect) {
  return effect.text().field_specimen == FieldSpecimen::gel ||
         effect.text().field_specimen == FieldSpecimen::any;
}
/// In gel it shows in recordings only.
bool is_of_the_rig(const Effect& effect) { return !effect.parameters().empty() && !is_of_gel(effect); }

/// Effects that are one of the specimen's pressures alone.
void add_effect_findings(const Study& study, std::vector<Finding>& findings) {
  const EffectLibrary library = effects_known_to(study);
  for (const std::string& id : study.effects) {
    const Effect& effect = effect_named(library, study, id);
    if (effect.text().port != Port::specimen) continue;
    if (!effect.field_parameters().empty() && !(is_gel(study) && is_of_the_rig(effect))) continue;
    findings.push_back(
        {Severity::warning, "effect-of-recordings",
         fmt::format("{} changes the specimen's pressure in recordings (explain, simulate), and "
                     "nothing of its deformation here",
                     id),
         study.file.string(), 1.0, "",
         "What is computed is the specimen without it; leave it out of [model] effects to be "
         "rid of this remark."});
  }
}

}  // namespace

bool is_gel(const Study& study) {
  const auto* annulus = std::get_if<AnnulusSpecimen>(&study.specimen);
  return annulus != nullptr && annulus->ends == "fixed" && study.law.name == "neo-hookean" && !study.chamber;
}

bool shows_in_images(const Study& study) {
  const EffectLibrary library = effects_known_to(study);
  return std::ranges::any_of(study.effects, [&](const std::string& id) {
    const Effect& effect = effect_named(library, study, id);
    return !effect.field_parameters().empty() && !(is_gel(study) && is_of_the_rig(effect));
  });
}

std::vector<Finding> model_findings(const Study& study) {
  std::vector<Finding> findings = fibre_findings(study);
  add_effect_findings(study, findings);
  return findings;
}

FieldModel field_model_of(const Study& study) {
  const auto& annulus = std::get<AnnulusSpecimen>(study.specimen);
  FieldModel model;
  model.inner_radius_mm = annulus.inner_radius_mm;
  model.outer_radius_mm = annulus.outer_radius_mm;
  model.height_mm = annulus.height_mm;
  const EffectLibrary library = effects_known_to(study);
  for (const std::string& id : study.effects) {
    const Effect& effect = effect_named(library, study, id);
    if (effect.field_parameters().empty() || is_of_the_rig(effect)) continue;
    if (!is_of_gel(effect))
      refuse(study, "model.effects", fmt::format("gel cannot have the effect \"{}\"", id),
             fmt::format("It is one that shows in {}; leave it out.", name_of(effect.text().field_specimen)));
    effect.apply_to_field(stated_field_values(study, effect, model), model);
  }
  return model;
}

FieldElasticity elasticity_of(const FieldModel& model, const HermiteMesh& mesh, double C1_kPa) {
  FieldElasticity result;
  ElasticOptions& options = result.options;
  const bool plain = model.beta == 0.0 && model.k1_kPa == 0.0;
  result.law = find_law(plain ? "neo-hookean" : "fibre-reinforced");
  options.parameters = plain ? std::vector{C1_kPa} : std::vector{C1_kPa, model.beta, model.k1_kPa, model.k2};
  if (!plain) options.material_axes = helical_axes(model.fibre_angle_deg);
  if (model.bond_stiffness_kPa_per_mm) let_ends_slip(mesh, *model.bond_stiffness_kPa_per_mm, options);
  if (model.chamber_stiffness_kPa_per_mL != 0.0)
    options.chamber = Chamber{.compliance_mL_per_kPa = 1.0 / model.chamber_stiffness_kPa_per_mL};
  if (model.inclusion) options.stiffness = stiffness_field(*model.inclusion);
  return result;
}

ElasticModel make_affected_model(const Study& study, SolveOptions options, std::vector<Finding>* findings) {
  Study plain = study;
  plain.effects.clear();
  const auto with_findings = [&](ElasticModel model) {
    if (findings != nullptr) add_effect_findings(study, *findings);
    return model;
  };
  if (!shows_in_images(study)) return with_findings(make_model(plain, std::move(options), findings));
  if (!is_gel(study))
    return with_findings(ChangeableSpecimen(study, findings).with(specimen_change_of(study), options));
  const FieldModel field = field_model_of(study);
  std::get<AnnulusSpecimen>(plain.specimen).inner_radius_mm = field.inner_radius_mm;
  const ElasticModel base = make_model(plain, {}, findings);
  FieldElasticity elastic = elasticity_of(field, base.mesh(), base.element_parameter(0, 0));
  elastic.options.solve = std::move(options);
  elastic.options.bulk_modulus_kPa = study.compression.bulk_modulus_kPa;
  elastic.options.volume_stiffness_kPa = study.compression.volume_stiffness_kPa;
  return with_findings({base.mesh(), *elastic.law, std::move(elastic.options)});
}

FieldModel field_change_of(const Study& study) {
  if (!shows_in_images(study)) return {};
  return is_gel(study) ? field_model_of(study) : specimen_change_of(study);
}

}  // namespace diastole
