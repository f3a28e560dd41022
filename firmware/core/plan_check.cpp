#include "firmware/core/plan_check.hpp"

#include <algorithm>

#include "firmware/core/backlash_compensation.hpp"
#include "firmware/core/profiles/profile.hpp"
#include "firmware/core/uploaded/crossings.hpp"

namespace diastole::firmware {

namespace {

constexpr std::uint64_t divide_up(std::uint64_t dividend, std::uint64_t divisor) {
  return (dividend + divisor - 1) / divisor;
}

std::uint64_t stopping_us(std::uint64_t flow_uL_per_s, const Settings& settings) {
  return divide_up(flow_uL_per_s * 1'000'000,
                   std::max<std::uint64_t>(settings.allowed_acceleration_uL_per_s2(), 1));
}

struct NormalisedPeaks {
  std::uint32_t speed_millionths;
  std::uint32_t acceleration_millionths;
};

NormalisedPeaks normalised_peaks(const Segment& segment) {
  if (segment.uploaded != nullptr)
    return {segment.uploaded->peak_speed_millionths, segment.uploaded->peak_acceleration_millionths};
  const Profile& profile = *find_profile(segment.waveform);
  return {profile.peak_speed_millionths, profile.peak_acceleration_millionths};
}

}  // namespace

PlanRefusal check_configuration(const wire::Configure& configure, const wire::MachineSettings& machine) {
  const auto refused = [](wire::Refusal refusal, wire::Limit limit, std::uint64_t asked,
                          std::uint64_t allowed) {
    return PlanRefusal{refusal, limit, 0, static_cast<std::int64_t>(asked),
                       static_cast<std::int64_t>(allowed)};
  };
  const std::uint64_t asked_pL = configure.microstep_pL, own_pL = wire::microstep_pL(machine);
  const std::uint64_t apart_pL = asked_pL > own_pL ? asked_pL - own_pL : own_pL - asked_pL;
  if (apart_pL * 50'000 > own_pL)
    return refused(wire::Refusal::settings_mismatch, wire::Limit::microstep, asked_pL, own_pL);
  if (configure.travel_uL > wire::travel_uL(machine))
    return refused(wire::Refusal::limit_exceeded, wire::Limit::travel, configure.travel_uL,
                   wire::travel_uL(machine));
  const std::uint64_t rate_Hz =
      static_cast<std::uint64_t>(machine.full_step_rate_Hz) * static_cast<std::uint64_t>(machine.microsteps);
  if (configure.step_rate_Hz > rate_Hz)
    return refused(wire::Refusal::limit_exceeded, wire::Limit::step_rate, configure.step_rate_Hz, rate_Hz);
  return {};
}

SegmentPeaks segment_peaks(const Segment& segment, const Settings& settings) {
  const auto [peak_speed_millionths, peak_acceleration_millionths] = normalised_peaks(segment);
  const wire::Configure& limits = settings.limits();
  const std::uint64_t stroke_nL = segment.stroke_nL;
  const std::uint64_t period_us = segment.period_us;
  SegmentPeaks peaks;
  peaks.flow_uL_per_s = divide_up(stroke_nL * peak_speed_millionths, period_us * 1000);
  peaks.acceleration_uL_per_s2 =
      divide_up(divide_up(stroke_nL * peak_acceleration_millionths, period_us) * 1000, period_us);
  peaks.step_rate_Hz = divide_up(peaks.flow_uL_per_s * 1'000'000, limits.microstep_pL);
  peaks.pressure_Pa =
      divide_up(divide_up(peaks.acceleration_uL_per_s2 * limits.inertance_kg_per_m4, 1'000'000), 1000) +
      settings.losses_Pa(peaks.flow_uL_per_s) + limits.cavity_Pa;
  peaks.stopping_us = stopping_us(peaks.flow_uL_per_s, settings);
  if (segment.moves()) peaks.cycle_steps = settings.steps_of_nL(segment.stroke_nL);
  return peaks;
}

std::uint64_t first_step_us(const Segment& segment, const Settings& settings) {
  if (!segment.moves()) return 0;
  const auto count = static_cast<std::uint32_t>(settings.steps_of_nL(segment.stroke_nL).count);
  const Q64 phase = segment.uploaded != nullptr
                        ? UploadedCrossings(*segment.uploaded, count).take().phase
                        : find_profile(segment.waveform)->phase_rising(ratio(1, 2 * count));
  return multiply_high(segment.period_us, phase) + 1;
}

namespace {

struct Check {
  wire::Limit limit;
  std::uint64_t asked;
  std::uint64_t allowed;
};

/// The first limit that one segment exceeds, or Limit::none.
Check check_segment(const Segment& segment, const Program& program, const Settings& settings) {
  const wire::Configure& limits = settings.limits();
  const SegmentPeaks peaks = segment_peaks(segment, settings);
  const std::uint64_t r_wave_spacing_us = std::uint64_t{segment.period_us} * program.gate_every;
  const Check at_most[] = {
      {wire::Limit::travel, divide_up(std::uint64_t{segment.stroke_nL} + segment.offset_nL, 1000),
       limits.travel_uL},
      {wire::Limit::flow, peaks.flow_uL_per_s, limits.flow_uL_per_s},
      {wire::Limit::acceleration, peaks.acceleration_uL_per_s2, limits.acceleration_uL_per_s2},
      {wire::Limit::step_rate, peaks.step_rate_Hz, limits.step_rate_Hz},
      {wire::Limit::pressure, peaks.pressure_Pa, limits.pressure_Pa},
      {wire::Limit::stopping_time, peaks.stopping_us, settings.allowed_stopping_us()},
      {wire::Limit::ttl_width, program.ttl_width_us, segment.period_us / 2},
  };
  for (const Check& check : at_most)
    if (check.asked > check.allowed) return check;
  if (segment.moves() && peaks.cycle_steps.count == 0)
    return {wire::Limit::stroke_at_least, segment.stroke_nL, divide_up(limits.microstep_pL, 1000)};
  if (r_wave_spacing_us <= program.r_wave_us)
    return {wire::Limit::r_wave_spacing, r_wave_spacing_us, program.r_wave_us + 1};
  if (program.trigger_delay_us > 0) {
    const std::uint64_t occupied_us =
        std::max(program.ttl_width_us, program.r_wave_us) + first_step_us(segment, settings);
    const std::uint64_t most_us = segment.period_us > occupied_us ? segment.period_us - occupied_us : 0;
    const bool possible =
        program.trigger_delay_us >= kLeastTriggerDelay_us && most_us >= kLeastTriggerDelay_us;
    if (!possible || program.trigger_delay_us > most_us)
      return {wire::Limit::trigger_delay, program.trigger_delay_us, possible ? most_us : 0};
  }
  return {wire::Limit::none, 0, 0};
}

}  // namespace

wire::Result<Ticks, PlanRefusal> check_program(const Program& program, const Settings& settings) {
  if (program.size == 0) return PlanRefusal{.refusal = wire::Refusal::no_program};
  std::uint64_t slowest_us = divide_up(settings.ramp_steps_per_s() * 1'000'000, settings.stop_steps_per_s2());
  for (std::size_t i = 0; i < program.size; ++i) {
    const Segment& segment = program.segments[i];
    const auto index = static_cast<std::uint16_t>(i);
    if (segment.uploaded == nullptr && find_profile(segment.waveform) == nullptr)
      return PlanRefusal{.refusal = segment.waveform == wire::Waveform::uploaded
                                        ? wire::Refusal::waveform_missing
                                        : wire::Refusal::unknown_waveform,
                         .segment = index};
    const Check check = check_segment(segment, program, settings);
    if (check.limit != wire::Limit::none)
      return PlanRefusal{wire::Refusal::limit_exceeded, check.limit, index,
                         static_cast<std::int64_t>(check.asked), static_cast<std::int64_t>(check.allowed)};
    slowest_us = std::max(slowest_us, segment_peaks(segment, settings).stopping_us);
  }
  return microseconds(static_cast<std::int64_t>(slowest_us));
}

wire::Result<std::uint32_t, PlanRefusal> check_compensation(const Program& program, const Settings& settings,
                                                            std::uint32_t backlash_steps) {
  if (backlash_steps == 0) return std::uint32_t{0};
  constexpr std::uint64_t kMost_us = 250'000;
  // Ramps accelerate at a quarter of what is allowed.
  std::uint64_t peak_steps_per_s2 = settings.stop_steps_per_s2() / 4;
  for (std::size_t i = 0; i < program.size; ++i)
    peak_steps_per_s2 =
        std::max(peak_steps_per_s2,
                 settings.steps_per_s(segment_peaks(program.segments[i], settings).acceleration_uL_per_s2));
  const std::uint64_t window_us = compensation_window_us(backlash_steps, peak_steps_per_s2, settings);
  for (std::size_t i = 0; i < program.size; ++i) {
    const Segment& segment = program.segments[i];
    const auto index = static_cast<std::uint16_t>(i);
    const std::uint64_t allowed_us = std::min<std::uint64_t>(segment.period_us / 8, kMost_us);
    if (window_us > allowed_us)
      return PlanRefusal{wire::Refusal::limit_exceeded, wire::Limit::take_up, index,
                         static_cast<std::int64_t>(window_us), static_cast<std::int64_t>(allowed_us)};
    // Twice the sum of both speeds, so that between two steps of the profile there is always room for one more.
    const std::uint64_t profile_Hz =
        std::min(segment_peaks(segment, settings).step_rate_Hz, peak_steps_per_s2 * window_us / 1'000'000);
    const std::uint64_t rate_Hz =
        2 * (profile_Hz + divide_up(std::uint64_t{2'000'000} * backlash_steps, window_us));
    if (rate_Hz > settings.limits().step_rate_Hz)
      return PlanRefusal{wire::Refusal::limit_exceeded, wire::Limit::step_rate, index,
                         static_cast<std::int64_t>(rate_Hz),
                         static_cast<std::int64_t>(settings.limits().step_rate_Hz)};
  }
  return static_cast<std::uint32_t>(window_us);
}

}  // namespace diastole::firmware
