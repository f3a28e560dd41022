#include "firmware/core/uploaded/waveform_store.hpp"

#include <algorithm>
#include <limits>

#include "firmware/core/uploaded/knot_cubic.hpp"
#include "protocol/wire/crc32.hpp"

namespace diastole::firmware {

namespace {

/// ⌈10^6 · numerator / denominator⌉, or 0 if it does not fit. Precondition: denominator < 2^44.
std::uint32_t millionths(std::uint64_t numerator, std::uint64_t denominator) {
  const std::uint64_t whole = numerator / denominator;
  if (whole >= std::numeric_limits<std::uint32_t>::max() / 1'000'000U) return 0;
  const std::uint64_t rest = numerator % denominator * 1'000'000U;
  return static_cast<std::uint32_t>(whole * 1'000'000U + (rest + denominator - 1) / denominator);
}

}  // namespace

wire::Result<UploadedWaveform, wire::Refusal> make_waveform(std::span<const std::int16_t> rises) {
  UploadedWaveform waveform{.rises = rises};
  const auto count = static_cast<std::int32_t>(rises.size());
  std::int32_t height = 0;
  std::int64_t steepest = 0, hardest = 0;
  for (std::int32_t i = 0; i < count; ++i) {
    height += waveform.rise(i);
    if (height < 0) return wire::Refusal::waveform_unfit;
    waveform.full_scale = std::max(waveform.full_scale, height);
    if (waveform.rise(i) == 0) continue;
    const KnotCubic curve = KnotCubic::between(waveform.rise(i - 1), waveform.rise(i), waveform.rise(i + 1));
    steepest = std::max(steepest, curve.steepest());
    hardest = std::max(hardest, curve.hardest());
  }
  if (height != 0 || waveform.full_scale == 0) return wire::Refusal::waveform_unfit;
  const auto intervals = static_cast<std::uint64_t>(count);
  const std::uint64_t twice_stroke = 2 * static_cast<std::uint64_t>(waveform.full_scale);
  waveform.peak_speed_millionths = millionths(static_cast<std::uint64_t>(steepest) * intervals, twice_stroke);
  waveform.peak_acceleration_millionths =
      millionths(static_cast<std::uint64_t>(hardest) * intervals * intervals, twice_stroke);
  if (waveform.peak_speed_millionths == 0 || waveform.peak_acceleration_millionths == 0)
    return wire::Refusal::waveform_unfit;
  return waveform;
}

wire::Refusal WaveformStore::begin(std::uint8_t number, std::uint16_t points, std::uint32_t crc) {
  expected_ = 0;
  if (number != waveforms_) return wire::Refusal::waveform_out_of_step;
  if (waveforms_ == kWaveforms || points > room()) return wire::Refusal::waveforms_full;
  expected_ = points;
  received_ = 0;
  crc_ = crc;
  return wire::Refusal::none;
}

wire::Refusal WaveformStore::append(std::uint16_t first, std::span<const std::int16_t> rises) {
  if (first != received_ || rises.size() > expected_ - received_ || expected_ == 0) {
    expected_ = 0;
    return wire::Refusal::waveform_out_of_step;
  }
  std::copy(rises.begin(), rises.end(), rises_.begin() + static_cast<std::ptrdiff_t>(used_ + received_));
  received_ += rises.size();
  return received_ == expected_ ? finish() : wire::Refusal::none;
}

wire::Refusal WaveformStore::finish() {
  const std::span<const std::int16_t> rises = std::span(rises_).subspan(used_, received_);
  expected_ = 0;
  wire::Crc32 crc;
  for (const std::int16_t rise : rises) {
    const auto bits = static_cast<std::uint16_t>(rise);
    crc.add(static_cast<std::uint8_t>(bits & 0xFFU));
    crc.add(static_cast<std::uint8_t>(bits >> 8));
  }
  if (crc.value() != crc_) return wire::Refusal::waveform_damaged;
  const auto waveform = make_waveform(rises);
  if (!waveform.ok()) return waveform.error();
  waveform_[waveforms_++] = *waveform;
  used_ += rises.size();
  return wire::Refusal::none;
}

}  // namespace diastole::firmware
