#include "firmware/core/uploaded/crossings.hpp"

namespace diastole::firmware {

namespace {

constexpr int kPlaces = 42;
constexpr std::int64_t kWhole = std::int64_t{1} << kPlaces;

/// value · fraction, rounded towards 0.
std::int64_t times(std::int64_t value, Q64 fraction) {
  return value < 0 ? -static_cast<std::int64_t>(multiply_high(static_cast<std::uint64_t>(-value), fraction))
                   : static_cast<std::int64_t>(multiply_high(static_cast<std::uint64_t>(value), fraction));
}

/// The curve's slope in the interval, in single precision: for steps, whose end is looked at exactly. Every operation is rounded by
/// itself (CMakeLists.txt), so that it is the same everywhere.
class Slope {
 public:
  Slope(const KnotCubic& curve, std::int64_t u)
      : square_(static_cast<float>(curve.square)),
        thrice_cube_u_(3.0F * static_cast<float>(curve.cube) * part(u)),
        slope_(static_cast<float>(curve.linear) + (2.0F * square_ + thrice_cube_u_) * part(u)) {}

  /// Newton's step for an excess of this size, in units of 2^-42 of the interval; the whole interval if it is beyond.
  [[nodiscard]] std::int64_t step(std::int64_t size) const {
    // Small ones, which nearly all are, are converted by the hardware.
    const float excess = size < std::int64_t{1} << 31 ? static_cast<float>(static_cast<std::int32_t>(size))
                                                      : static_cast<float>(size);
    const float exact = slope_ > 0 ? excess / slope_ : 0x1p42F;
    if (exact < 0x1p30F) return static_cast<std::int32_t>(exact);
    return exact < 0x1p42F ? std::int64_t{static_cast<std::int32_t>(exact * 0x1p-12F)} << 12 : kWhole;
  }
  /// After a step of this size at most half a place is missing: it leaves |f''/2f'| step².
  [[nodiscard]] bool suffices(std::int64_t step) const {
    if (step >= std::int64_t{1} << 20) return false;
    const auto size = static_cast<float>(static_cast<std::int32_t>(step));
    const float half_second = square_ + thrice_cube_u_;
    const float missing = size * 0x1p-42F * size * (half_second < 0 ? -half_second : half_second);
    return 2.0F * missing < slope_;
  }

 private:
  static float part(std::int64_t u) {
    return static_cast<float>(static_cast<std::int32_t>(u >> 12)) * 0x1p-30F;
  }

  float square_, thrice_cube_u_, slope_;
};

/// Where linear u + square u² + cube u³ = target, from `below` on and probably at `guess` (not beyond `below`: nobody knows).
/// Precondition: the cubic rises from 0 to beyond target.
std::int64_t solve(const KnotCubic& curve, std::int64_t target, std::int64_t below, std::int64_t guess) {
  std::int64_t above = kWhole;
  std::int64_t u = guess;
  if (u <= below) {  // as of a straight line
    const std::int32_t end = curve.linear + curve.square + curve.cube;
    u = Slope({.linear = end}, 0).step(target > 0 ? target : 1);
  }
  if (u <= below || u >= above) u = below + (above - below) / 2;
  while (above - below > 1) {
    const Q64 fraction = static_cast<Q64>(u) << (64 - kPlaces);
    const std::int64_t outer = curve.cube * u + (std::int64_t{curve.square} << kPlaces);
    const std::int64_t inner = times(outer, fraction) + (std::int64_t{curve.linear} << kPlaces);
    // The cubic rises, so that what it rises by on the way is not negative.
    const auto risen = static_cast<std::int64_t>(multiply_high(static_cast<std::uint64_t>(inner), fraction));
    const std::int64_t excess = risen - target;
    if (excess == 0) return u;
    (excess < 0 ? below : above) = u;
    const Slope slope(curve, u);
    const std::int64_t step = slope.step(excess < 0 ? -excess : excess);
    if (step <= 1) return u;
    u = excess < 0 ? u + step : u - step;
    if (u <= below || u >= above)
      u = below + (above - below) / 2;
    else if (slope.suffices(step))
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
  surely_ = static_cast<std::int32_t>(stroke / 4 / levels) + 2;
  restart();
}

void UploadedCrossings::restart() {
  knot_ = height_ = 0;
  next_ = half_;
  rising_ = true;
  last_ = pace_ = guess_ = 0;
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
  const std::int32_t beyond = rising_ ? flank_height_ - next_.whole : next_.whole - flank_height_;
  if (beyond > surely_) return true;
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
      last_ = pace_ = guess_ = 0;
      begin_flank();
      continue;
    }
    const std::int32_t end = height_ + 2 * waveform_->rises[static_cast<std::size_t>(knot_)];
    if (interval_reaches_next(end)) return;
    height_ = end;
    ++knot_;
    last_ -= kWhole;
    guess_ -= kWhole;
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
  }
  const std::int64_t place = solve(curve_, next_above_knot(), last_ > 0 ? last_ : 0, guess_);
  const std::int64_t pace = place - last_;
  guess_ = place + 2 * pace - pace_;
  pace_ = pace;
  last_ = place;
  const Q64 within = multiply_high(static_cast<Q64>(place) << (64 - kPlaces), interval_fraction_);
  const Crossing crossing{static_cast<std::uint32_t>(knot_) * interval_fraction_ + within, rising_};
  rising_ ? raise_next() : lower_next();
  seek();
  return crossing;
}

}  // namespace diastole::firmware
