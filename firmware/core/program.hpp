#pragma once
// What was configured and what is to be run, in the controller's own units.

#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/core/profiles/profile.hpp"
#include "firmware/core/units.hpp"
#include "firmware/core/uploaded/waveform_store.hpp"
#include "protocol/wire/program_messages.hpp"

namespace diastole::firmware {

struct Segment {
  wire::Waveform waveform{};
  std::uint32_t cycles = 0;
  std::uint32_t stroke_nL = 0;
  std::uint32_t offset_nL = 0;
  std::uint32_t period_us = 0;
  const UploadedWaveform* uploaded = nullptr;  ///< of Waveform::uploaded

  /// Precondition: check_program accepted it.
  [[nodiscard]] bool moves() const { return uploaded != nullptr || find_profile(waveform)->moves(); }
};

struct Program {
  static constexpr std::size_t kMaxSegments = 64;
  std::array<Segment, kMaxSegments> segments{};
  std::size_t size = 0;
  std::uint16_t gate_every = 1;
  std::uint32_t rest_us = 0;
  std::uint32_t ttl_width_us = 0;
  std::uint32_t r_wave_us = 30'000;  ///< the R-wave's length, and so the least distance of two
  std::uint32_t trigger_delay_us = 0;
  std::uint32_t position_period_ticks = 0;
};

/// What must remain of the lease for the host's heartbeats; the rest is for coming to rest.
inline constexpr std::uint32_t kHeartbeatGrace_us = 150'000;

/// Geometry and limits as Configure brings them, with what follows from them.
class Settings {
 public:
  Settings() = default;
  explicit Settings(const wire::Configure& configure);

  [[nodiscard]] const wire::Configure& limits() const { return configure_; }
  /// Volume in whole microsteps, rounded to the nearest.
  [[nodiscard]] Steps steps_of_nL(std::uint64_t volume_nL) const {
    const std::uint64_t volume_pL = volume_nL * 1000;
    return {static_cast<std::int32_t>((volume_pL + configure_.microstep_pL / 2) / configure_.microstep_pL)};
  }
  [[nodiscard]] std::uint64_t steps_per_s(std::uint64_t flow_uL_per_s) const {
    return flow_uL_per_s * 1'000'000 / configure_.microstep_pL;
  }
  /// The largest acceleration that both the acceleration and the pressure limit allow.
  [[nodiscard]] std::uint64_t allowed_acceleration_uL_per_s2() const {
    const std::uint64_t limit = configure_.acceleration_uL_per_s2;
    if (configure_.inertance_kg_per_m4 == 0) return limit;
    const std::uint64_t by_pressure =
        std::uint64_t{configure_.pressure_Pa} * 1'000'000'000 / configure_.inertance_kg_per_m4;
    return by_pressure < limit ? by_pressure : limit;
  }
  /// Deceleration of a controlled stop, at least 1.
  [[nodiscard]] std::uint64_t stop_steps_per_s2() const {
    const std::uint64_t rate = steps_per_s(allowed_acceleration_uL_per_s2());
    return rate > 0 ? rate : 1;
  }
  /// Pressure lost to friction and at the hose's ends at a steady flow, rounded up, 4e9 at most (message Configure).
  [[nodiscard]] std::uint32_t losses_Pa(std::uint64_t flow_uL_per_s) const;
  /// Largest speed that the flow, the step rate and, by losses and cavity alone, the pressure limit allow, in microsteps per
  /// second, at least 1.
  [[nodiscard]] std::uint64_t allowed_steps_per_s() const {
    const std::uint64_t by_flow = steps_per_s(allowed_flow_uL_per_s_);
    const std::uint64_t least = by_flow < configure_.step_rate_Hz ? by_flow : configure_.step_rate_Hz;
    return least > 0 ? least : 1;
  }

  /// Time that a controlled stop may take, so that heartbeats have kHeartbeatGrace_us of the lease.
  [[nodiscard]] std::uint32_t allowed_stopping_us() const {
    return configure_.lease_us > kHeartbeatGrace_us ? configure_.lease_us - kHeartbeatGrace_us : 0;
  }
  /// Speed of the ramps between segments: half of what is allowed, and stopped in half the time allowed.
  [[nodiscard]] std::uint64_t ramp_steps_per_s() const {
    const std::uint64_t stoppable = stop_steps_per_s2() * allowed_stopping_us() / 2'000'000;
    const std::uint64_t half = allowed_steps_per_s() / 2;
    const std::uint64_t least = half < stoppable ? half : stoppable;
    return least > 0 ? least : 1;
  }
  /// Largest speed of homing and jogging: half of what is allowed, and stopped in a quarter of the lease.
  [[nodiscard]] std::uint64_t hand_steps_per_s() const {
    const std::uint64_t stoppable = stop_steps_per_s2() * configure_.lease_us / 4'000'000;
    const std::uint64_t half = allowed_steps_per_s() / 2;
    const std::uint64_t least = half < stoppable ? half : stoppable;
    return least > 0 ? least : 1;
  }
  /// Time of a smooth ramp over a distance: at least 1 s, within ramp_steps_per_s and a quarter of the
  /// allowed acceleration (parabolic: speed 2 D/t, acceleration 4 D/t²).
  [[nodiscard]] Ticks ramp_time(Steps distance) const;

 private:
  wire::Configure configure_;
  std::uint32_t allowed_flow_uL_per_s_ = 0;
};

}  // namespace diastole::firmware
