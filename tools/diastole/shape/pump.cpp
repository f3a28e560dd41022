#include "tools/diastole/shape/pump.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/core/plan_check.hpp"
#include "host/controller/wire_program.hpp"

namespace diastole::shaping {
namespace {

constexpr size_t least_points = 160, most_points = 320;
constexpr double least_delay_ms = 0.1;  ///< of a trigger, if it has one

/// Rises between even phases from where the drive is least, in units of which the largest one fills 16 bits.
std::vector<int16_t> rises_of(const PeriodicCurve& drive, double begins_s, size_t points) {
  std::vector<double> heights;
  const double least = drive.at(begins_s);
  for (size_t j = 0; j < points; ++j)
    heights.push_back(std::max(
        drive.at(begins_s + drive.period_s * static_cast<double>(j) / static_cast<double>(points)) - least,
        0.0));
  heights.push_back(0.0);
  double largest = 0.0;
  for (size_t j = 0; j < points; ++j)
    largest = std::max(largest, std::abs(heights[j + 1] - heights[j]));
  if (!(largest > 0.0)) return {};
  const double scale = std::floor(32766.0 / largest);
  std::vector<int16_t> rises;
  for (size_t j = 0; j < points; ++j)
    rises.push_back(
        static_cast<int16_t>(std::lround(scale * heights[j + 1]) - std::lround(scale * heights[j])));
  return rises;
}

uint32_t in_millionths(double value) { return static_cast<uint32_t>(std::llround(1e6 * value)); }

std::vector<LimitUse> uses_of(const firmware::Segment& segment, const firmware::Settings& settings) {
  const firmware::SegmentPeaks peaks = firmware::segment_peaks(segment, settings);
  const wire::Configure& limits = settings.limits();
  const auto use = [](const char* limit, uint64_t asked, uint64_t allowed, double scale, const char* unit) {
    return LimitUse{limit, scale * static_cast<double>(asked), scale * static_cast<double>(allowed), unit};
  };
  return {
      use("travel", (uint64_t{segment.stroke_nL} + segment.offset_nL) / 1000, limits.travel_uL, 1e-3, "mL"),
      use("flow", peaks.flow_uL_per_s, limits.flow_uL_per_s, 1e-3, "mL/s"),
      use("acceleration", peaks.acceleration_uL_per_s2, limits.acceleration_uL_per_s2, 1e-3, "mL/s2"),
      use("step_rate", peaks.step_rate_Hz, limits.step_rate_Hz, 1.0, "Hz"),
      use("pressure", peaks.pressure_Pa, limits.pressure_Pa, 1e-3, "kPa"),
      use("stopping_time", peaks.stopping_us, settings.allowed_stopping_us(), 1e-3, "ms")};
}

constexpr const char* limit_names[] = {
#define DIASTOLE_LIMIT(number, name, unit) #name,
#include "protocol/wire/limit_list.inc"
};

}  // namespace

Pump::Pump(const RigConfig& rig)
    : settings_(configuration(rig, static_cast<uint32_t>(std::llround(1e9 * rig.microstep_mL)))),
      ttl_width_ms_(rig.controller.ttl_width_ms) {}

double Pump::rounding_mL() const { return 1e-9 * settings_.limits().microstep_pL / std::sqrt(12.0); }

DriveBounds Pump::bounds(double share) const {
  const wire::Configure& limits = settings_.limits();
  const double microstep_mL = 1e-9 * limits.microstep_pL;
  const double braking_mL_s2 = 1e-3 * static_cast<double>(settings_.allowed_acceleration_uL_per_s2());
  const double flow_mL_s = std::min({1e-3 * limits.flow_uL_per_s, microstep_mL * limits.step_rate_Hz,
                                     1e-6 * settings_.allowed_stopping_us() * braking_mL_s2});
  return {.least_mL = 0.0,
          .most_mL = share * 1e-3 * limits.travel_uL,
          .flow_mL_s = share * flow_mL_s,
          .acceleration_mL_s2 = [this, share](double flow) {
            const wire::Configure& allowed = settings_.limits();
            const double losses_Pa = settings_.losses_Pa(static_cast<uint64_t>(1e3 * flow / share));
            const double left_Pa = allowed.pressure_Pa - losses_Pa - allowed.cavity_Pa;
            const double by_pressure = 1e6 * left_Pa / std::max<double>(allowed.inertance_kg_per_m4, 1.0);
            return share * std::min(by_pressure, 1e-3 * allowed.acceleration_uL_per_s2);
          }};
}

PlannedCycle Pump::planned(const PeriodicCurve& drive_mL) const {
  const double begins_s = drive_mL.least_at_s();
  std::vector<int16_t> rises;
  firmware::UploadedWaveform waveform;
  for (size_t points = least_points; points <= most_points; points += 4) {
    std::vector<int16_t> trial = rises_of(drive_mL, begins_s, points);
    const auto made = firmware::make_waveform(trial);
    if (!made.ok()) continue;
    if (!rises.empty() && made->peak_acceleration_millionths >= waveform.peak_acceleration_millionths)
      continue;
    rises = std::move(trial);
    waveform = *made;
  }
  PlannedCycle cycle{.fraction = {}, .period_s = drive_mL.period_s, .limits = {}, .refusal = {}};
  if (rises.empty()) {
    cycle.refusal = unfit_waveform;
    return cycle;
  }
  waveform.rises = rises;
  const double scale = static_cast<double>(waveform.full_scale);
  double height = 0.0, highest = 0.0;
  cycle.fraction.push_back(0.0);
  for (size_t j = 0; j < rises.size(); ++j) {
    cycle.fraction.push_back((height += rises[j]) / scale);
    const double phase = static_cast<double>(j) / static_cast<double>(rises.size());
    highest = std::max(highest, drive_mL.at(begins_s + drive_mL.period_s * phase));
  }
  cycle.offset_mL = std::max(drive_mL.at(begins_s), 0.0);
  cycle.stroke_mL = highest - drive_mL.at(begins_s);
  firmware::Segment segment{.waveform = wire::Waveform::uploaded,
                            .cycles = 1,
                            .stroke_nL = in_millionths(cycle.stroke_mL),
                            .offset_nL = in_millionths(cycle.offset_mL),
                            .period_us = in_millionths(cycle.period_s),
                            .uploaded = &waveform};
  cycle.limits = uses_of(segment, settings_);
  firmware::Program program{.size = 1, .ttl_width_us = static_cast<uint32_t>(1e3 * ttl_width_ms_)};
  program.segments[0] = segment;
  if (const auto checked = firmware::check_program(program, settings_); !checked.ok())
    cycle.refusal = limit_names[static_cast<size_t>(checked.error().limit)];
  if (settings_.steps_of_nL(segment.stroke_nL).count == 0) return cycle;  // it has no first step
  cycle.lead_s = std::fmod(drive_mL.period_s - begins_s, drive_mL.period_s);
  const double first_step_ms = 1e-3 * static_cast<double>(firmware::first_step_us(segment, settings_));
  const double most_ms =
      1e3 * cycle.period_s - std::max(ttl_width_ms_, 1e-3 * program.r_wave_us) - first_step_ms - 1.0;
  const double asked_ms = 1e3 * cycle.lead_s - first_step_ms;
  cycle.trigger_delay_ms = asked_ms >= least_delay_ms && asked_ms <= most_ms ? asked_ms : 0.0;
  cycle.trigger_late_ms = cycle.trigger_delay_ms > 0.0 ? 0.0 : -asked_ms;
  if (cycle.trigger_late_ms < -500.0 * cycle.period_s) cycle.trigger_late_ms += 1e3 * cycle.period_s;
  return cycle;
}

PeriodicCurve Pump::nearest(const PeriodicCurve& drive_mL, const Eigen::MatrixXd& slope) const {
  // Between the points runs the controller's curve, which turns a little harder than the drive itself.
  PeriodicCurve nearest = drive_mL;
  for (const double share : {1.0, 0.98, 0.95, 0.9, 0.85, 0.8, 0.7, 0.6, 0.5}) {
    nearest = nearest_within(drive_mL, slope, bounds(share));
    if (planned(nearest).refusal.empty()) break;
  }
  return nearest;
}

}  // namespace diastole::shaping
