#include "estimator/rig/motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace diastole::rig {
namespace {

using std::numbers::pi;

}  // namespace

double Stroke::volume_mL(double time_s) const {
  const double s = std::clamp((time_s - start_s) / (end_s - start_s), 0.0, 1.0);
  const double rise = to_mL - from_mL;
  if (cosine) return from_mL + rise * 0.5 * (1.0 - std::cos(pi * s));
  const double speed = 1.0 / (1.0 - round);
  double part = speed * (s - 0.5 * round);
  if (s < round) part = 0.5 * speed * s * s / round;
  if (s > 1.0 - round) part = 1.0 - 0.5 * speed * (1.0 - s) * (1.0 - s) / round;
  return from_mL + rise * part;
}

double Stroke::integral_mL_s(double time_s) const {
  const double duration = end_s - start_s;
  const double s = std::clamp((time_s - start_s) / duration, 0.0, 1.0);
  const double speed = 1.0 / (1.0 - round);
  double area = 0.0;
  if (cosine) {
    area = 0.5 * (s - std::sin(pi * s) / pi);
  } else if (s < round) {
    area = speed * s * s * s / (6.0 * round);
  } else if (s <= 1.0 - round) {
    const double ramp = s - round;
    area = speed * (round * round / 6.0 + 0.5 * round * ramp + 0.5 * ramp * ramp);
  } else {
    const double left = 1.0 - s;
    area = 0.5 - left + speed * left * left * left / (6.0 * round);  // symmetry: the whole area is one half
  }
  return duration * (from_mL * s + (to_mL - from_mL) * area) + to_mL * std::max(time_s - end_s, 0.0);
}

double Stroke::flow_mL_per_s(double time_s) const {
  if (time_s <= start_s || time_s >= end_s) return 0.0;
  const double s = (time_s - start_s) / (end_s - start_s);
  const double mean = (to_mL - from_mL) / (end_s - start_s);
  if (cosine) return mean * 0.5 * pi * std::sin(pi * s);
  return mean / (1.0 - round) * std::min({1.0, s / round, (1.0 - s) / round});
}

Motion::Motion(std::vector<Stroke> strokes, double rest_mL, double spread_s)
    : strokes_(std::move(strokes)), rest_mL_(rest_mL), spread_s_(spread_s) {
  double time_s = strokes_.empty() ? 0.0 : strokes_.front().start_s;
  double volume_mL = rest_mL_;
  double integral = 0.0;
  for (const Stroke& stroke : strokes_) {
    integral += volume_mL * (stroke.start_s - time_s);
    integral_before_.push_back(integral);
    integral += stroke.integral_mL_s(stroke.end_s);
    time_s = stroke.end_s;
    volume_mL = stroke.to_mL;
  }
}

Motion::Ideal Motion::ideal(double time_s) const {
  const auto after = std::partition_point(strokes_.begin(), strokes_.end(),
                                          [&](const Stroke& stroke) { return stroke.start_s <= time_s; });
  if (after == strokes_.begin()) {
    const double start = strokes_.empty() ? 0.0 : strokes_.front().start_s;
    return {rest_mL_, rest_mL_ * (time_s - start), 0.0};
  }
  const Stroke& stroke = *(after - 1);
  const double before = integral_before_[static_cast<size_t>(after - 1 - strokes_.begin())];
  return {stroke.volume_mL(time_s), before + stroke.integral_mL_s(time_s), stroke.flow_mL_per_s(time_s)};
}

Motion::State Motion::at(double time_s) const {
  const double window_s = std::max(spread_s_, 1e-4);
  const Ideal early = ideal(time_s - 0.5 * window_s);
  const Ideal late = ideal(time_s + 0.5 * window_s);
  return {(late.integral_mL_s - early.integral_mL_s) / window_s,
          (late.volume_mL - early.volume_mL) / window_s,
          (late.flow_mL_per_s - early.flow_mL_per_s) / window_s};
}

}  // namespace diastole::rig
