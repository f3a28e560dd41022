#pragma once
// The peripheral bus: which device answers at an address, whether its clock is on, and what the vendor's description says
// to the access.

#include <cstdint>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/sim_board/core/device.hpp"
#include "tools/sim_board/core/notes.hpp"
#include "tools/sim_board/core/register_facts.hpp"

namespace diastole::board_model {

/// Bit of an RCC enable register (offset 0x30 AHB1 ... 0x44 APB2) that clocks a device; the reset register
/// with the same bits lies 0x20 below.
struct ClockGate {
  uint32_t enable_offset = 0;  ///< 0: always clocked
  uint32_t bit = 0;
};

enum class ClockState {
  off,
  coming_up,  ///< enabled so shortly before that the peripheral may not answer yet (errata sheet ES0182, 2.2.13)
  on,
};

class Bus {
 public:
  static constexpr uint32_t block_bytes = 0x400;

  struct Place {
    std::string name;
    uint32_t base = 0;
    ClockGate gate;
    Device* device = nullptr;
  };

  explicit Bus(Notes& notes) : notes_(notes) {}

  /// Registers a device at `blocks` blocks of 1 KB from `base` on; its offsets count from `base`.
  void add(Place place, uint32_t blocks = 1) {
    for (uint32_t block = 0; block < blocks; ++block) {
      by_block_[block_of(place.base) + block] = static_cast<uint32_t>(places_.size());
    }
    places_.push_back(std::move(place));
  }
  /// How the state of a gate is asked for; without it all are open.
  void gate_by(std::function<ClockState(ClockGate)> clock_of) { clock_of_ = std::move(clock_of); }

  /// `bytes` is 1, 2 or 4. A register that nobody models reads 0 and is noted.
  uint32_t read(uint32_t address, uint32_t bytes) {
    const Place* place = find(address, "read");
    if (place == nullptr) return 0;
    const std::optional<std::string> wrong = judge_.read(address, bytes);
    const std::optional<uint32_t> word = place->device->read((address - place->base) & ~3U);
    if (wrong)
      notes_.add(*wrong);
    else if (!word)
      notes_.add("read of a register that is not modelled: " + place->name + " at " +
                 hexadecimal(address & ~3U));
    return (word.value_or(0) >> (8 * (address & 3))) & width_mask(bytes);
  }
  void write(uint32_t address, uint32_t value, uint32_t bytes) {
    const Place* place = find(address, "write");
    if (place == nullptr) return;
    if (auto wrong = judge_.write(address, value, bytes)) notes_.add(*wrong);
    const uint32_t shift = 8 * (address & 3);
    place->device->write((address - place->base) & ~3U, value << shift, width_mask(bytes) << shift);
  }

  void reset_all() {
    for (const Place& place : places_)
      place.device->reset();
  }
  /// Resets the devices whose bit is set in the RCC reset register that belongs to `enable_offset`.
  void reset_gated(uint32_t enable_offset, uint32_t bits) {
    for (const Place& place : places_) {
      if (place.gate.enable_offset == enable_offset && (bits >> place.gate.bit & 1) != 0)
        place.device->reset();
    }
  }
  [[nodiscard]] const std::vector<Place>& places() const { return places_; }

 private:
  static std::string hexadecimal(uint32_t value) {
    char text[16];
    std::snprintf(text, sizeof text, "0x%08x", value);
    return text;
  }

  static uint32_t width_mask(uint32_t bytes) { return bytes >= 4 ? 0xffff'ffff : (1U << (8 * bytes)) - 1; }

  static constexpr uint32_t no_place = 0xffffffff;

  /// 0x4000'0000-0x5fff'ffff by block, then the private peripherals from 0xe000'0000.
  [[nodiscard]] static uint32_t block_of(uint32_t address) {
    return address >= 0xe000'0000 ? peripheral_blocks + (address - 0xe000'0000) / block_bytes
                                  : (address - 0x4000'0000) / block_bytes;
  }
  Place* find(uint32_t address, const char* action) {
    const uint32_t block = block_of(address);
    const uint32_t index = block < by_block_.size() ? by_block_[block] : no_place;
    if (index == no_place) {
      notes_.add(std::string(action) + " of a register that is not modelled: block at " +
                 hexadecimal(address & ~(block_bytes - 1)));
      return nullptr;
    }
    Place& place = places_[index];
    if (place.gate.enable_offset == 0 || !clock_of_) return &place;
    const ClockState clock = clock_of_(place.gate);
    if (clock == ClockState::off) {
      notes_.add(std::string(action) + " of " + place.name + " while its clock is off");
      return nullptr;
    }
    if (clock == ClockState::coming_up)
      notes_.add(std::string(action) + " of " + place.name + " before its clock has come up");
    return &place;
  }

  static constexpr uint32_t peripheral_blocks = 0x2000'0000 / block_bytes;
  static constexpr uint32_t private_blocks = 0x10'0000 / block_bytes;

  Notes& notes_;
  RegisterJudge judge_;
  std::function<ClockState(ClockGate)> clock_of_;
  std::vector<Place> places_;
  std::vector<uint32_t> by_block_ = std::vector<uint32_t>(peripheral_blocks + private_blocks, no_place);
};

}  // namespace diastole::board_model
