#pragma once
// What tracking makes of one image.

#include <Eigen/Core>
#include <vector>

#include "estimator/imaging/tracking/materials.hpp"

namespace diastole::imaging {

struct TrackedPhase {
  MaterialMap materials;
  Eigen::ArrayXXf depth_mm;  ///< of tissue
  Eigen::ArrayXXf residual;  ///< grey values, in tissue as far as it was fitted; 0 elsewhere
  std::vector<Eigen::ArrayXXf>
      slope;  ///< a direction: the image's derivative by w, grey values per mm; 0 where it was not fitted
  double noise = 0;   ///< standard deviation of the residual, robust, grey values
  size_t pixels = 0;  ///< that were fitted
};

}  // namespace diastole::imaging
