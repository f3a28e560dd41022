#include "estimator/model/changed_specimen.hpp"

#include <fmt/format.h>

#include <cmath>

#include "estimator/io/study_refusal.hpp"
#include "estimator/materials/reinforced_law.hpp"
#include "estimator/mesh/nodal_lines.hpp"
#include "estimator/model/study_effects.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

/// G along the circumference, by the depth in the wall.
double residual_stretch(const HermiteMesh& mesh, const MaterialPoint& point, double depth, double by_xi3,
                        double opening_angle_deg) {
  const Vector3d X_mm = mesh.value(mesh.reference(), point);
  const double wall_mm = mesh.xi_gradient(mesh.reference(), point).col(2).norm() / by_xi3;
  const double radius_mm = std::hypot(X_mm[0], X_mm[1]);
  // Near the axis a ring's curvature has no meaning: a wall is no thicker than the radius of its ring.
  const double curvature = 1.0 / std::max(radius_mm, wall_mm);
  return 1.0 + (depth - 0.5) * wall_mm * curvature * opening_angle_deg / 180.0;
}

bool has_one_held_end(const HermiteMesh& mesh) {
  return mesh.faces().bottom.empty() != mesh.faces().top.empty();
}

}  // namespace

ChangeableSpecimen::ChangeableSpecimen(Study study, std::vector<Finding>* findings) {
  study.effects.clear();
  parts_ = std::make_shared<const SpecimenParts>(specimen_parts(study, {}, findings));
  stiffness_ = std::make_shared<const InclusionStiffness>(mesh());
  depths_ = std::make_shared<const std::vector<double>>(NodalLines(mesh()).depths());
}

bool ChangeableSpecimen::takes(const Effect& effect) const {
  if (effect.field_parameters().empty()) return false;
  switch (effect.text().field_specimen) {
    case FieldSpecimen::gel:
      return false;
    case FieldSpecimen::any:
    case FieldSpecimen::other:
      // A body whose stiffness depends on the place is incompressible (elastic_system.hpp).
      return !effect.is_inclusion() || !parts_->options.bulk_modulus_kPa;
    case FieldSpecimen::fibred:
      return parts_->body.fibres.has_value() && parts_->law->needs_axes();
    case FieldSpecimen::hung:
      return has_one_held_end(mesh()) && parts_->options.bonded.empty();
  }
  return false;
}

std::vector<const Effect*> ChangeableSpecimen::effects() const {
  std::vector<const Effect*> those;
  for (const Effect* effect : specimen_effects())
    if (takes(*effect)) those.push_back(effect);
  return those;
}

ElasticModel ChangeableSpecimen::with(const FieldModel& change, const SolveOptions& solve) const {
  ElasticOptions options = parts_->options;
  options.solve = solve;
  const Law* law = parts_->law;
  if (change.k1_kPa != 0.0) {
    law = &reinforced(*law);
    options.parameters.insert(options.parameters.end(), {change.k1_kPa, change.k2, change.fibre_angle_deg});
  }
  const bool turned = change.fibre_turn_deg != 0.0 || change.fibre_course_deg != 0.0;
  if (change.k1_kPa != 0.0 || change.opening_angle_deg != 0.0 || turned) {
    options.material_axes = [change, turned, depths = depths_, fibres = parts_->options.material_axes](
                                const HermiteMesh& mesh, const MaterialPoint& point) {
      const Eigen::Matrix3d wall = wall_axes(mesh, point);
      const double depth = between_nodes(mesh, *depths, point);
      MaterialAxes axes = fibres ? fibres(mesh, point) : MaterialAxes(wall);
      if (turned) {
        const double angle =
            rad_per_deg * (change.fibre_turn_deg + change.fibre_course_deg * (1.0 - 2.0 * depth));
        axes = AngleAxisd(angle, wall.col(2)).toRotationMatrix() * axes;
      }
      if (change.opening_angle_deg != 0.0) {
        MaterialPoint inner = point, outer = point;
        inner.xi[2] = 0.0;
        outer.xi[2] = 1.0;
        const double by_xi3 = between_nodes(mesh, *depths, outer) - between_nodes(mesh, *depths, inner);
        const double stretch = residual_stretch(mesh, point, depth, by_xi3, change.opening_angle_deg);
        axes = wall * Vector3d(stretch, 1.0, 1.0 / stretch).asDiagonal() * wall.transpose() * axes;
      }
      return axes;
    };
  }
  if (change.inclusion) options.stiffness = stiffness_field(*change.inclusion);
  ElasticModel body(parts_->body.mesh, *law, options);
  if (change.inclusion) {  // its means about the Gauss points
    const GaussNumbers numbers = stiffness_->of(*change.inclusion);
    for (size_t element = 0; element < numbers.size(); ++element)
      body.system().set_stiffness(element, numbers[element]);
  }
  return body;
}

FieldModel specimen_change_of(const Study& study) {
  const ChangeableSpecimen specimen(study);
  const EffectLibrary library = effects_known_to(study);
  FieldModel change;
  for (const std::string& id : study.effects) {
    const Effect& effect = effect_named(library, study, id);
    if (effect.field_parameters().empty()) continue;
    if (!specimen.takes(effect))
      refuse(study, "model.effects", fmt::format("this specimen cannot have the effect \"{}\"", id),
             "`diastole effects` says which specimens have it; leave it out, or describe such a specimen.");
    effect.apply_to_field(stated_field_values(study, effect, change), change);
  }
  return change;
}

}  // namespace diastole
