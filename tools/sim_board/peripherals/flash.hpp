#pragma once
// The 1 MB flash and its interface: unlocking, programming (bits only fall from 1 to 0), sector erase, busy
// times, error flags, and a power cut in the middle of an operation (RM0090, 3).
//
// Sectors: 0-3 16 KB, 4 64 KB, 5-11 128 KB. Operations are counted from the last power-up; one that the power
// cut hits is left half done: a word keeps every second bit that should have fallen, an erase clears the
// first half.

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "tools/sim_board/core/memory.hpp"
#include "tools/sim_board/core/notes.hpp"
#include "tools/sim_board/core/scheduler.hpp"

namespace diastole::board_model {

struct Sector {
  uint32_t offset = 0, bytes = 0;
};
/// Precondition: number < 12.
Sector flash_sector(uint32_t number);

class Flash final : public Device {
 public:
  Flash(std::span<uint8_t> memory, const Clock& clock, Scheduler& scheduler, Notes& notes);

  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void reset() override;
  void on_event(Cycles at) override;
  void after_clock_change() override;

  /// A store of the program to [0x0800'0000, +1 MB): programs when CR.PG allows it, else sets an error flag.
  void store(uint32_t offset, uint32_t value, uint32_t bytes);

  /// End of the operation in progress; 0 when idle. Code in flash stalls until then.
  [[nodiscard]] Cycles busy_until() const { return busy_ ? busy_until_ : 0; }

  [[nodiscard]] uint64_t operations() const { return operations_; }
  /// Power fails in the middle of operation number `operation` (1 is the first from now).
  void cut_power_at(std::optional<uint64_t> operation) {
    cut_at_ = operation ? std::optional(operations_ + *operation) : std::nullopt;
  }

  struct Listeners {
    std::function<void(uint32_t offset, uint32_t bytes)> changed;  ///< contents: translations must go
    std::function<void()> power_cut;
  };
  void listen(Listeners listeners) { listeners_ = std::move(listeners); }

 private:
  void write_key(uint32_t key);
  void write_control(uint32_t value);
  void erase(uint32_t first, uint32_t bytes, uint64_t duration_ns);
  bool begin_operation(uint64_t duration_ns);
  void changed(uint32_t offset, uint32_t bytes);
  void check_wait_states();

  std::span<uint8_t> memory_;
  const Clock& clock_;
  Scheduler& scheduler_;
  Notes& notes_;
  Scheduler::Slot slot_;
  Listeners listeners_;
  uint32_t acr_ = 0, sr_ = 0, cr_ = 0x8000'0000;
  bool first_key_ = false, key_fault_ = false;
  bool busy_ = false;
  Cycles busy_until_ = 0;
  uint64_t operations_ = 0;
  std::optional<uint64_t> cut_at_;
};

}  // namespace diastole::board_model
