#pragma once
// Whether the reconstructed motion keeps the tissue's volume: J = det(dx/dX), which is 1 in an incompressible body.
// Nothing in the reconstruction asks for it, so J - 1 beyond its standard error is a fault of the data (scale of the
// images, misplaced slices), of the smoothing, or a tissue that does change its volume.

#include "estimator/reconstruction/frame_field.hpp"

namespace diastole {

struct ElementVolume {
  double mean_ratio = 1.0;  ///< volume now / volume before
  double se = 0.0;
};

struct VolumeCheck {
  double mean_ratio = 1.0;  ///< of the whole body
  double se = 0.0;          ///< with smoothing_error
  double smoothing_error =
      0.0;               ///< what smoothing makes of the volumes of this field and of the largest motion
  double rms = 0.0;      ///< of J - 1 over the body
  double p95 = 0.0;      ///< of |J - 1|
  double largest = 0.0;  ///< of |J - 1|, at Gauss points
  std::vector<ElementVolume> elements;
};

/// `largest`: the frame of the largest motion, in which smoothing hides the least.
VolumeCheck check_volume(const FieldForms& forms, const FrameField& field, const FrameField& largest);

}  // namespace diastole
