// The fibres' angle goes through the wall in another course than assumed.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect fibre_course_effect() {
  return {{
      .id = "fibre-course",
      .title = "another course of the fibres through the wall",
      .port = Port::field,
      .equations =
          "Helix angle + angle (1 - 2 depth): by the angle at the inner wall, reversed at the outer one.",
      .source = "D. D. Streeter et al., Circ. Res. 24 (1969) 339: the helix angle's range through the wall.",
      .looks_like = "The wall twists more or less than the model's, and lengthens otherwise.",
      .revealed_by = "Diffusion images of the fibres (`diastole fibres`).",
      .conflicts = {"fibre-turn"},
      .field_parameters = {{"angle_deg", "deg", "at the inner wall; reversed at the outer one", 0.0, -60.0,
                            60.0, 10.0}},
      .field_specimen = FieldSpecimen::fibred,
      .apply_to_field = [](EffectValues values, FieldModel& model) { model.fibre_course_deg = values[0]; },
  }};
}

}  // namespace diastole
