// The base that a ventricle hangs from moves with the load.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect base_motion_effect() {
  return {{
      .id = "base-motion",
      .title = "motion of the base",
      .port = Port::field,
      .equations =
          "x_seen = x + motion P: the base, and all that hangs from it, moves in proportion to the load.",
      .source = "A mount that yields; rigid motion of a body held at one end.",
      .looks_like = "All of the body moves by the same amount, the base too.",
      .revealed_by = "Tags or marks on the mount itself.",
      .field_parameters = {{"x_mm_per_kPa", "mm/kPa", "along x", 0.0, -20.0, 20.0, 0.3},
                           {"y_mm_per_kPa", "mm/kPa", "along y", 0.0, -20.0, 20.0, 0.3},
                           {"z_mm_per_kPa", "mm/kPa", "along z", 0.0, -20.0, 20.0, 0.3}},
      .field_specimen = FieldSpecimen::hung,
      .apply_to_field =
          [](EffectValues values, FieldModel& model) {
            model.base_motion_mm_per_kPa = {values[0], values[1], values[2]};
          },
  }};
}

}  // namespace diastole
