// The fluid around the specimen yields only against pressure.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect chamber_back_pressure_effect() {
  return {{
      .id = "chamber-back-pressure",
      .title = "back pressure of the chamber",
      .port = Port::specimen,
      .equations = "p_cavity = p_specimen(V) + k V.",
      .source = "A closed chamber of stiffness k around an incompressible wall.",
      .looks_like =
          "The cavity seems stiffer and straighter: a part of the pressure is proportional to volume.",
      .revealed_by = "Strokes of different size, where the specimen alone softens; the field, which moves "
                     "less than the pressure says.",
      .conflicts = {"strain-stiffening", "radius-error", "stroke-gain"},
      .parameters = {{"k_Pa_mL", "Pa/mL", "stiffness of the chamber", 0.0, 0.0, 200.0, 15.0}},
      .apply =
          [](EffectValues values, const EffectContext&, rig::RigModel& model) {
            std::vector<rig::SpecimenCurve::Point> points = model.curve.points();
            const double stiffness = 1e-3 * values[0] / model.modulus_kPa;
            for (rig::SpecimenCurve::Point& point : points) {
              point.pressure_kPa += stiffness * point.volume_mL;
              point.stiffness_kPa_per_mL += stiffness;
            }
            model.curve = rig::SpecimenCurve(std::move(points));
          },
      .field_parameters = {{"k_kPa_per_mL", "kPa/mL", "stiffness of the chamber", 0.0, 0.0, 0.2, 0.01}},
      .apply_to_field = [](EffectValues values,
                           FieldModel& model) { model.chamber_stiffness_kPa_per_mL = values[0]; },
  }};
}

}  // namespace diastole
