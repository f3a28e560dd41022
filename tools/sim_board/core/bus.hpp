#pragma once
// The peripheral bus: which device answers at an address, and whether its clock is on.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tools/sim_board/core/clock.hpp"
#include "tools/sim_board/core/device.hpp"
#include "tools/sim_board/core/notes.hpp"

namespace diastole::board_model {

/// Bit of an RCC enable register (offset 0x30 AHB1 ... 0x44 APB2) that clocks a device; the reset register
/// with the same bits lies 0x20 below.
struct ClockGate {
  uint32_t enable_offset = 0;  ///< 0: always clocked
  uint32_t bit = 0;
};

/// The state of the gates, owned by RCC.
class Gates {
 public:
  [[nodiscard]] virtual bool clocked(ClockGate gate) const = 0;

 protected:
  ~Gates() = default;
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

  Bus(const Clock& clock, Notes& notes) : clock_(clock), notes_(notes) {}

  /// Registers a device at `blocks` blocks of 1 KB from `base` on; its offsets count from `base`.
  void add(Place place, uint32_t blocks = 1);
  void use_gates(const Gates& gates) { gates_ = &gates; }

  /// `bytes` is 1, 2 or 4. A block that nobody models reads 0 and is noted once.
  uint32_t read(uint32_t address, uint32_t bytes);
  void write(uint32_t address, uint32_t value, uint32_t bytes);

  void reset_all();
  /// Resets the devices whose bit is set in the RCC reset register that belongs to `enable_offset`.
  void reset_gated(uint32_t enable_offset, uint32_t bits);
  [[nodiscard]] const std::vector<Place>& places() const { return places_; }

 private:
  static constexpr uint32_t no_place = 0xffffffff;

  /// 0x4000'0000-0x5fff'ffff by block, then the private peripherals from 0xe000'0000.
  [[nodiscard]] static uint32_t block_of(uint32_t address) {
    return address >= 0xe000'0000 ? peripheral_blocks + (address - 0xe000'0000) / block_bytes
                                  : (address - 0x4000'0000) / block_bytes;
  }
  Place* find(uint32_t address, const char* action);

  static constexpr uint32_t peripheral_blocks = 0x2000'0000 / block_bytes;
  static constexpr uint32_t private_blocks = 0x10'0000 / block_bytes;

  const Clock& clock_;
  Notes& notes_;
  const Gates* gates_ = nullptr;
  std::vector<Place> places_;
  std::vector<uint32_t> by_block_ = std::vector<uint32_t>(peripheral_blocks + private_blocks, no_place);
};

}  // namespace diastole::board_model
