#include "firmware/core/program.hpp"

#include <algorithm>
#include <cmath>

namespace diastole::firmware {

/// The allowed flow is found by halving, so that it is the same on the host and on the board.
Settings::Settings(const wire::Configure& configure) : configure_(configure) {
  std::uint32_t within = 0, beyond = configure.flow_uL_per_s + 1;
  while (beyond - within > 1) {
    const std::uint32_t middle = within + (beyond - within) / 2;
    (std::uint64_t{losses_Pa(middle)} + configure.cavity_Pa <= configure.pressure_Pa ? within : beyond) =
        middle;
  }
  allowed_flow_uL_per_s_ = within;
}

/// Whole numbers of 32 bits, so that the processor converts them itself.
std::uint32_t Settings::losses_Pa(std::uint64_t flow_uL_per_s) const {
  constexpr std::uint64_t kMostFlow_uL_per_s = 20'000'000;  // twice what any limit can be
  constexpr float kMost_Pa = 4e9F;
  const auto flow = static_cast<std::uint32_t>(std::min(flow_uL_per_s, kMostFlow_uL_per_s));
  const float flow_L_per_s = static_cast<float>(flow) * 1e-6F;
  const float root = std::sqrt(flow_L_per_s);
  const float laminar_Pa = static_cast<float>(configure_.laminar_Pa) * flow_L_per_s;
  const float turbulent_Pa =
      static_cast<float>(configure_.turbulent_Pa) * flow_L_per_s * root * std::sqrt(root);
  const float minor_Pa = static_cast<float>(configure_.minor_Pa) * flow_L_per_s * flow_L_per_s;
  const float losses_Pa = std::min(std::max(laminar_Pa, turbulent_Pa) + minor_Pa, kMost_Pa);
  const auto whole_Pa = static_cast<std::uint32_t>(losses_Pa);
  return whole_Pa + (static_cast<float>(whole_Pa) < losses_Pa ? 1 : 0);
}

Ticks Settings::ramp_time(Steps distance) const {
  const auto steps =
      static_cast<std::uint64_t>(distance.count < 0 ? -std::int64_t{distance.count} : distance.count);
  const std::uint64_t speed = ramp_steps_per_s();
  const std::uint64_t acceleration = stop_steps_per_s2();
  std::uint64_t time_ms = 1000;
  while (2000 * steps > speed * time_ms || 16'000'000 * steps > acceleration * time_ms * time_ms)
    time_ms += time_ms / 8;
  return microseconds(static_cast<std::int64_t>(time_ms * 1000));
}

}  // namespace diastole::firmware
