#include "firmware/core/uploaded/crossings.hpp"

#include <bit>

namespace diastole::firmware {

namespace {

constexpr int kPlaces = 42;
constexpr std::int64_t kWhole = std::int64_t{1} << kPlaces;

/// value · u for u in units of 2^-42, below 1; rounded towards 0.
std::int64_t times(std::int64_t value, std::int64_t u) {
  const Q64 fraction = static_cast<Q64>(u) << (64 - kPlaces);
  return value < 0 ? -static_cast<std::int64_t>(multiply_high(static_cast<std::uint64_t>(-value), fraction))
                   : static_cast<std::int64_t>(multiply_high(static_cast<std::uint64_t>(value), fraction));
}

/// The leading bits of a positive number, below 2^30, and how many places were dropped.
struct Leading {
  std::int32_t bits;
  int dropped;
};
Leading leading(std::int64_t value) {
  const int dropped = 34 - std::countl_zero(static_cast<std::uint64_t>(value));
  const std::int64_t bits = dropped >= 0 ? value >> dropped : value << -dropped;
  return {static_cast<std::int32_t>(bits), dropped};
}

/// About 2^42 · dividend / divisor, both positive; at most 2^42.
std::int64_t quotient(std::int64_t dividend, std::int64_t divisor) {
  const Leading a = leading(dividend), b = leading(divisor);
  const float ratio = static_cast<float>(a.bits) / static_cast<float>(b.bits);  // 0.5 … 2
  const auto bits = static_cast<std::int32_t>(ratio * 0x1p24F);
  const int shift = a.dropped - b.dropped + kPlaces - 24;
  if (shift > kPlaces - 24) return kWhole;
  if (shift >= 0) return std::int64_t{bits} << shift;
  return shift > -32 ? bits >> -shift : 0;
}

/// After a Newton step of this size at most half a place is missing: it leaves |f''/2f'| step².
bool step_suffices(std::int64_t step, std::int64_t half_second, std::int64_t slope) {
  if (step >= std::int64_t{1} << 20) return false;
  const auto size = static_cast<std::uint64_t>(half_second < 0 ? -half_second : half_second);
  return multiply_high(static_cast<std::uint64_t>(step * step), size) < static_cast<std::uint64_t>(slope) >>
         (64 - kPlaces + 1);
}

/// Where linear u + square u² + cube u³ = target, from `below` on and probably `pace` beyond it (0: nobody knows).
/// Precondition: the cubic rises from 0 to beyond target.
std::int64_t solve(const KnotCubic& curve, std::int64_t target, std::int64_t below, std::int64_t pace) {
  std::int64_t above = kWhole;
  const std::int64_t end = std::int64_t{curve.linear} + curve.square + curve.cube;
  std::int64_t u = pace > 0 ? below + pace : quotient(target > 0 ? target : 1, end << kPlaces);
  if (u <= below || u >= above) u = below + (above - below) / 2;
  while (above - below > 1) {
    const std::int64_t outer = curve.cube * u + (std::int64_t{curve.square} << kPlaces);
    const std::int64_t inner = times(outer, u) + (std::int64_t{curve.linear} << kPlaces);
    const std::int64_t excess = times(inner, u) - target;
    if (excess == 0) return u;
    const std::int64_t slope = times(outer + curve.cube * u, u) + inner;
    (excess < 0 ? below : above) = u;
    const std::int64_t step = slope > 0 ? quotient(excess < 0 ? -excess : excess, slope) : kWhole;
    if (step <= 1) return u;
    u = excess < 0 ? u + step : u - step;
    if (u <= below || u >= above)
      u = below + (above - below) / 2;
    else if (step_suffices(step, outer + 2 * curve.cube * u, slope))
      return u;
  }
  return below;
}

}  // namespace

UploadedCrossings::UploadedCrossings(const UploadedWaveform& waveform, std::uint32_t levels)
    : waveform_(&waveform),
      levels_(levels),
      level_fraction_(levels > 1 ? ratio(1, levels) : 0),
      intervals_(static_cast<std::int32_t>(waveform.rises.size())) {
  interval_fraction_ = ratio(1, static_cast<std::uint32_t>(intervals_));
  const auto stroke = static_cast<std::uint32_t>(waveform.full_scale);
  half_ = {static_cast<std::int32_t>(stroke / levels), stroke % levels};
  spacing_ = {static_cast<std::int32_t>(2 * stroke / levels), 2 * stroke % levels};
  restart();
}

void UploadedCrossings::restart() {
  knot_ = height_ = 0;
  next_ = half_;
  rising_ = true;
  from_ = 0;
  begin_flank();
  seek();
}

void UploadedCrossings::raise_next() {
  next_.whole += spacing_.whole;
  next_.rest += spacing_.rest;
  if (next_.rest < levels_) return;
  next_.rest -= levels_;
  ++next_.whole;
}

void UploadedCrossings::lower_next() {
  next_.whole -= spacing_.whole;
  if (next_.rest < spacing_.rest) {
    next_.rest += levels_;
    --next_.whole;
  }
  next_.rest -= spacing_.rest;
}

/// A flank goes on as far as no rise has the other sign; the level next on it is one below that of a rising one.
void UploadedCrossings::begin_flank() {
  const bool was_rising = rising_;
  bool known = false;
  flank_end_ = knot_;
  flank_height_ = height_;
  for (; flank_end_ < intervals_; ++flank_end_) {
    const std::int32_t rise = waveform_->rises[static_cast<std::size_t>(flank_end_)];
    if (rise != 0 && known && (rise > 0) != rising_) break;
    if (rise != 0 && !known) {
      known = true;
      rising_ = rise > 0;
    }
    flank_height_ += 2 * rise;
  }
  if (was_rising && !rising_) lower_next();
  if (!was_rising && rising_) raise_next();
}

bool UploadedCrossings::flank_reaches_next() const {
  const std::int64_t height = std::int64_t{flank_height_ - next_.whole} * levels_ - next_.rest;
  return (rising_ ? height : -height) > waveform_->full_scale / 4;
}

bool UploadedCrossings::interval_reaches_next(std::int32_t end) const {
  if (rising_) return end > next_.whole;
  return end < next_.whole || (end == next_.whole && next_.rest > 0);
}

/// Goes on to the interval in which the next level is crossed.
void UploadedCrossings::seek() {
  while (knot_ < intervals_) {
    if (!flank_reaches_next()) {
      knot_ = flank_end_;
      height_ = flank_height_;
      from_ = 0;
      begin_flank();
      continue;
    }
    const std::int32_t end = height_ + 2 * waveform_->rises[static_cast<std::size_t>(knot_)];
    if (interval_reaches_next(end)) return;
    height_ = end;
    ++knot_;
    from_ = 0;
  }
}

/// The next level's height over the interval's beginning, seen in the direction of the flank.
std::int64_t UploadedCrossings::next_above_knot() const {
  const auto part = static_cast<std::int64_t>(next_.rest * level_fraction_ >> (64 - kPlaces));
  const std::int64_t height = (std::int64_t{next_.whole - height_} << kPlaces) + part;
  return rising_ ? height : -height;
}

UploadedCrossings::Crossing UploadedCrossings::take() {
  if (curved_ != knot_) {
    curve_ =
        KnotCubic::between(waveform_->rise(knot_ - 1), waveform_->rise(knot_), waveform_->rise(knot_ + 1));
    curved_ = knot_;
    pace_ = 0;
  }
  const std::int64_t before = from_;
  from_ = solve(curve_, next_above_knot(), from_, pace_);
  pace_ = from_ - before;
  const Q64 within = multiply_high(static_cast<Q64>(from_) << (64 - kPlaces), interval_fraction_);
  const Crossing crossing{static_cast<std::uint32_t>(knot_) * interval_fraction_ + within, rising_};
  rising_ ? raise_next() : lower_next();
  seek();
  return crossing;
}

}  // namespace diastole::firmware
