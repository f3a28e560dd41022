// The images show displacements too large or too small.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect tag_bias_effect() {
  return {{
      .id = "tag-bias",
      .title = "gain of the imaged displacement",
      .port = Port::field,
      .equations = "x_seen = X + gain (x - X).",
      .source = "Tracking that lags behind faded tags, gradients out of calibration: errors proportional to "
                "the displacement.",
      .looks_like =
          "The specimen moves by one factor too far or too little at all places and pressures alike.",
      .revealed_by = "An independent modulus (a shear test); gated cavity volumes against those of the tags. "
                     "With the modulus free it is the modulus.",
      .conflicts = {"chamber-back-pressure", "radius-error"},
      .field_parameters = {{"gain", "", "displacement as seen over the true one", 1.0, 0.7, 1.3, 0.95}},
      .field_specimen = FieldSpecimen::any,
      .apply_to_field = [](EffectValues values, FieldModel& model) { model.displacement_gain = values[0]; },
  }};
}

}  // namespace diastole
