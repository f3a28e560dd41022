#pragma once
// ADC1 and the converters' common control (RM0090 13): single conversions of one channel started by software, with their
// sampling time, at the clock that the prescaler makes. Full scale is the supply. ADC2 and ADC3 are not modelled; what else
// ADC1 can do (scan, continuous, injected, triggers, DMA, watchdog) is noted.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "tools/sim_board/core/device.hpp"
#include "tools/sim_board/core/notes.hpp"
#include "tools/sim_board/core/scheduler.hpp"

namespace diastole::board_model {

class Adc final : public RegisterBlock {
 public:
  /// Volts at a channel's input at a moment; nothing: the channel leads to no analog pin.
  using Input = std::function<std::optional<double>(uint32_t channel, Cycles at)>;

  static constexpr uint32_t reference_channel = 17;
  static constexpr double reference_V = 1.21;  // VREFINT, typical

  Adc(const Clock& clock, Scheduler& scheduler, Notes& notes)
      : clock_(clock), notes_(notes), scheduler_(scheduler), slot_(scheduler.add(*this)) {
    reset();
  }
  void wire(Input input) { input_ = std::move(input); }
  void set_supply_mV(uint32_t supply_mV) { supply_V_ = 1e-3 * supply_mV; }

  std::optional<uint32_t> read(uint32_t offset) override {
    if (offset == common_status) return words_[status / 4];
    if (offset == data) words_[status / 4] &= ~end_of_conversion;
    return RegisterBlock::read(offset);
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    if (offset == status) {
      words_[0] &= value | ~mask;
      return;
    }
    if (offset == data || offset == common_status) return;
    const uint32_t before = words_[control2 / 4];
    RegisterBlock::write(offset, value, mask);
    if (offset != control2) return;
    const uint32_t now = words_[control2 / 4];
    if ((now & ~(on | start | end_each)) != 0 || (words_[1] & ~resolution) != 0) unmodelled();
    if ((now & on) != 0 && (before & on) == 0) on_since_ = clock_.now();
    words_[control2 / 4] &= ~start;
    if ((now & start) != 0 && (now & on) != 0) convert();
  }
  void reset() override {
    words_.fill(0);
    words_[high_threshold / 4] = 0xfff;
    ccr_ = 0;
    scheduler_.set(slot_, never);
  }
  void on_event(Cycles at) override {
    scheduler_.set(slot_, never);
    words_[data / 4] = code_at(at);
    words_[status / 4] |= end_of_conversion;
  }

 private:
  static constexpr uint32_t status = 0x00, control2 = 0x08, sampling1 = 0x0c, sampling2 = 0x10,
                            high_threshold = 0x24, sequence1 = 0x2c, sequence3 = 0x34, data = 0x4c,
                            common_status = 0x300, common_control = 0x304;
  static constexpr uint32_t on = 1, start = 1U << 30, end_each = 1U << 10, end_of_conversion = 1U << 1,
                            started = 1U << 4, resolution = 3U << 24, reference_on = 1U << 23;
  static constexpr uint64_t stabilisation_ns = 3'000, reference_start_ns = 10'000;  // datasheet, at most

  uint32_t* word(uint32_t offset) override {
    if (offset == common_control) return &ccr_;
    return offset <= data ? &words_[offset / 4] : nullptr;
  }
  [[nodiscard]] uint32_t channel() const { return words_[sequence3 / 4] & 0x1f; }
  [[nodiscard]] uint32_t conversion_cycles() const {
    constexpr uint32_t sampling[] = {3, 15, 28, 56, 84, 112, 144, 480};
    constexpr uint32_t bits = 12;
    const uint32_t number = channel();
    const uint32_t held = words_[(number >= 10 ? sampling1 : sampling2) / 4];
    return sampling[held >> 3 * (number % 10) & 7] + bits;
  }
  void convert() {
    if (clock_.now() < on_since_ + clock_.cycles_in(stabilisation_ns))
      notes_.add("ADC1: a conversion is started before the converter has come up");
    if ((words_[sequence1 / 4] >> 20 & 0xf) != 0) unmodelled();
    if (channel() == reference_channel &&
        ((ccr_ & reference_on) == 0 || clock_.now() < on_since_ + clock_.cycles_in(reference_start_ns)))
      notes_.add("ADC1: the reference is converted before it is on");
    const uint32_t divider = 2 * ((ccr_ >> 16 & 3) + 1) * clock_.tree().apb2_ratio;
    if (clock_.tree().core_Hz / divider > 36'000'000) notes_.add("ADC clock above 36 MHz");
    words_[status / 4] |= started;
    scheduler_.set(slot_, clock_.now() + Cycles{conversion_cycles()} * divider);
  }
  [[nodiscard]] uint32_t code_at(Cycles at) {
    std::optional<double> input_V = channel() == reference_channel ? std::optional(reference_V)
                                    : input_                       ? input_(channel(), at)
                                                                   : 0.0;
    if (!input_V) {
      notes_.add("ADC1: channel " + std::to_string(channel()) + " is converted and its pin is not analog");
      input_V = 0;
    }
    return static_cast<uint32_t>(std::clamp(std::lround(*input_V / supply_V_ * 4095), 0L, 4095L));
  }
  void unmodelled() { notes_.add("ADC1: all but single conversions by software is not modelled"); }

  const Clock& clock_;
  Notes& notes_;
  Scheduler& scheduler_;
  Scheduler::Slot slot_;
  Input input_;
  double supply_V_ = 3.3;
  Cycles on_since_ = 0;
  std::array<uint32_t, 20> words_{};
  uint32_t ccr_ = 0;
};

}  // namespace diastole::board_model
