// The wall is under stress without load: a ring of it that is cut through opens.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect residual_stress_effect() {
  return {{
      .id = "residual-stress",
      .title = "residual stress",
      .port = Port::field,
      .equations =
          "F_elastic = F G; G stretches along the circumference by 1 + (depth - 1/2) h angle / (pi R), along "
          "the wall's normal by its inverse: outside under tension, inside compressed, h the wall's "
          "thickness and R the distance from z.",
      .source = "J. H. Omens, Y. C. Fung, Circ. Res. 66 (1990) 37: rat ventricles open by 45 degrees; the "
                "tensor as in "
                "E. K. Rodriguez, A. Hoger, A. D. McCulloch, J. Biomech. 27 (1994) 455.",
      .looks_like =
          "The inner wall stretches more and the outer one less than the model's: the thickening is "
          "spread more evenly.",
      .revealed_by = "A ring cut through: the angle at which it opens.",
      .field_parameters = {{"opening_angle_deg", "deg", "at which a ring that is cut through opens", 0.0,
                            -180.0, 180.0, 40.0}},
      .field_specimen = FieldSpecimen::other,
      .apply_to_field = [](EffectValues values, FieldModel& model) { model.opening_angle_deg = values[0]; },
  }};
}

}  // namespace diastole
