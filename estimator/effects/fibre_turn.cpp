// The fibres run at another angle than assumed, everywhere alike.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect fibre_turn_effect() {
  return {{
      .id = "fibre-turn",
      .title = "fibres turned by an angle",
      .port = Port::field,
      .equations = "Helix angle + angle: the material axes turn about the wall's normal, everywhere alike.",
      .source = "P. M. F. Nielsen, I. J. LeGrice, B. H. Smaill, P. J. Hunter, Am. J. Physiol. 260 (1991) "
                "H1365: fibre "
                "angles as they were measured.",
      .looks_like =
          "The wall twists and lengthens otherwise than the model's, most where it is stretched most.",
      .revealed_by = "Diffusion images of the fibres (`diastole fibres`).",
      .conflicts = {"fibre-course"},
      .field_parameters = {{"angle_deg", "deg", "from the circumference towards the base", 0.0, -60.0, 60.0,
                            8.0}},
      .field_specimen = FieldSpecimen::fibred,
      .apply_to_field = [](EffectValues values, FieldModel& model) { model.fibre_turn_deg = values[0]; },
  }};
}

}  // namespace diastole
