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
  double se = 0.0;
  double rms = 0.0;      ///< of J - 1 over the body
  double p95 = 0.0;      ///< of |J - 1|
  double largest = 0.0;  ///< of |J - 1|, at Gauss points
  std::vector<ElementVolume> elements;
};

VolumeCheck check_volume(const FieldForms& forms, const FrameField& field);

}  // namespace diastole
