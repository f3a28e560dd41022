// Fibres make the wall stiffer in one direction.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect fibre_anisotropy_effect() {
  return {{
      .id = "fibre-anisotropy",
      .title = "one family of fibres",
      .port = Port::field,
      .equations = "W = C1 (I1 - 3) + k1/(2 k2) (exp(k2 (I4 - 1)^2) - 1), fibres at an angle to the "
                   "circumference, or to the fibres that the specimen has already; k2 = 0 is k1/2 (I4 - "
                   "1)^2. Any law takes "
                   "the place of C1 (I1 - 3).",
      .source = "G. A. Holzapfel, T. C. Gasser, R. W. Ogden, J. Elast. 61 (2000) 1; "
                "estimator/materials/fibre_reinforced.cpp.",
      .looks_like = "The wall moves less where its fibres are stretched, and between the plates it turns "
                    "about the axis if they run obliquely.",
      .revealed_by = "Tags in all three directions; diffusion images of the fibres.",
      .conflicts = {"strain-stiffening"},
      .field_parameters = {{"k1_kPa", "kPa", "stress of the fibres for I4 - 1", 0.0, 0.0, 60.0, 3.0},
                           {"angle_deg", "deg",
                            "of the fibres from the circumference, or from those that are there, towards z",
                            0.0, -180.0, 180.0, 15.0},
                           {"k2", "", "stiffening of the fibres with (I4 - 1)^2", 0.0, 0.0, 60.0, 2.0}},
      .field_essentials = 2,
      .field_specimen = FieldSpecimen::any,
      .field_direction = {{1, 180.0}},
      .apply_to_field =
          [](EffectValues values, FieldModel& model) {
            model.k1_kPa = values[0];
            model.fibre_angle_deg = values[1];
            model.k2 = values[2];
          },
  }};
}

}  // namespace diastole
