#include <cstddef>

#include "estimator/rig/rig_model.hpp"

namespace diastole::rig {

void DriveTrace::differentiate() {
  const size_t count = volume_mL.size();
  const auto slope = [&](const std::vector<double>& values, size_t k) {
    const size_t before = k > 0 ? k - 1 : 0;
    const size_t after = k + 1 < count ? k + 1 : k;
    return (values[after] - values[before]) / (step_s * static_cast<double>(after - before));
  };
  for (size_t k = 0; k < count; ++k)
    flow_mL_per_s[k] = slope(volume_mL, k);
  for (size_t k = 0; k < count; ++k)
    acceleration_mL_per_s2[k] = slope(flow_mL_per_s, k);
}

}  // namespace diastole::rig
