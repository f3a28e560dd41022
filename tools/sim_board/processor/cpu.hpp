#pragma once
// The Cortex-M4: Unicorn translates and executes the instructions; exceptions, sleep, time and the checks
// that Unicorn leaves out are done here.
//
// One instruction is one cycle, and what flash_access.hpp says of the flash's wait states comes on top. Code runs block by block (up to the next branch, and never over a page); at
// each block's start time is brought up to date, events that are due happen, and an exception may be taken. A
// register access therefore happens at the time of its block's start (but for stall_after_store()) and an exception is taken up to a
// block late; what timers do is exact. Stacking costs 12 cycles, unstacking 10, tail-chaining 6.

#include <unicorn/unicorn.h>

#include <memory>
#include <optional>
#include <string>

#include "tools/sim_board/core/bus.hpp"
#include "tools/sim_board/core/memory.hpp"
#include "tools/sim_board/core/nvic.hpp"
#include "tools/sim_board/core/scheduler.hpp"
#include "tools/sim_board/peripherals/flash.hpp"
#include "tools/sim_board/peripherals/system_control.hpp"
#include "tools/sim_board/processor/block_table.hpp"
#include "tools/sim_board/processor/flash_access.hpp"

namespace diastole::board_model {

/// What the core works with; all outlive it.
struct CpuParts {
  Clock& clock;
  Memory& memory;
  Bus& bus;
  Scheduler& scheduler;
  Nvic& nvic;
  SystemControl& control;
  Flash& flash;
  Notes& notes;
};

class Cpu {
 public:
  Cpu(CpuParts parts, FlashTiming timing);
  ~Cpu();
  Cpu(const Cpu&) = delete;
  Cpu& operator=(const Cpu&) = delete;

  /// Registers to their reset state, stack pointer and program counter from the vector table at 0.
  void reset();

  /// Runs until `limit` (reached at a block's boundary, or exactly when asleep) or until interrupt() was
  /// called.
  void run_until(Cycles limit);

  /// Ends run_until() at the next boundary: a reset or loss of power is to be dealt with.
  void interrupt();

  /// The core stands still for so long behind the program's next store to this register; what is due meanwhile happens.
  void stall_after_store(uint32_t address, Cycles cycles) { stall_ = Stall{address, cycles}; }

  /// Flash changed under the code.
  void forget_code(uint32_t offset, uint32_t bytes);

  [[nodiscard]] uint64_t instructions() const { return instructions_; }
  /// Cycles spent waiting for the flash.
  [[nodiscard]] Cycles flash_wait_cycles() const { return flash_wait_cycles_; }
  /// Cycles spent waiting for an interrupt.
  [[nodiscard]] Cycles asleep_cycles() const { return asleep_cycles_; }
  /// The last fault in words, empty when there was none since power-up.
  [[nodiscard]] const std::string& last_fault() const { return last_fault_; }
  /// A fault within the hard-fault handler: only a reset helps.
  /// Executes nothing while held; time goes on.
  void hold(bool held) { held_ = held; }
  [[nodiscard]] bool locked_up() const { return locked_up_; }
  [[nodiscard]] bool asleep() const { return asleep_; }

 private:
  enum class Stop {
    none,
    limit,
    interrupted,
    exception,
    exception_return,
    supervisor_call,
    fault,
    float_disabled,
    protection_changed
  };

  struct EngineCloser {
    void operator()(uc_engine* engine) const { uc_close(engine); }
  };

  void map_memory();
  void add_hooks();
  void block(uint64_t address, uint32_t bytes);
  void finish_block();
  void stop(Stop reason);
  void execute();
  void sort_out(uc_err result);
  void run_to_float();
  void idle(Cycles limit);

  void enter(uint32_t number, bool chained);
  enum class Stacked { done, denied, no_memory };
  Stacked stack_frame();
  void exception_return(uint32_t magic);
  bool unstack_frame(uint32_t magic);
  void raise(uint32_t number, uint32_t status_bits, uint32_t address, const char* what);
  void lock_up(const char* why);

  /// The memory protection unit has other regions: they count from the next block on.
  void protection_changed();
  void apply_protection();
  [[nodiscard]] bool denied(uint32_t address, uint32_t bytes) const;

  [[nodiscard]] Masks masks();
  [[nodiscard]] uint32_t get(int reg);
  void set(int reg, uint32_t value);

  static void on_block(uc_engine*, uint64_t address, uint32_t bytes, void* self);
  static void on_interrupt(uc_engine*, uint32_t number, void* self);
  static bool on_bad_access(uc_engine*, uc_mem_type type, uint64_t address, int bytes, int64_t value,
                            void* self);
  static void on_flash_read(uc_engine*, uc_mem_type, uint64_t address, int bytes, int64_t value, void* self);
  static uint64_t on_read(uc_engine*, uint64_t offset, unsigned bytes, void* self);
  static void on_write(uc_engine*, uint64_t offset, unsigned bytes, uint64_t value, void* self);

  struct Stall {
    uint32_t address;
    Cycles cycles;
  };

  /// A mapped range of registers; Unicorn passes offsets only.
  struct Window {
    Cpu* cpu;
    uint32_t base, bytes;
  };

  CpuParts parts_;
  std::unique_ptr<uc_engine, EngineCloser> engine_;
  std::vector<Window> windows_;
  BlockTable flash_blocks_, sram_blocks_;
  FlashAccess flash_access_;
  Cycles pending_waits_ = 0, flash_wait_cycles_ = 0;
  std::vector<uint8_t> return_page_;

  std::vector<SystemControl::ProtectedRegion> regions_;
  bool protection_stale_ = false;
  Cycles limit_ = 0;
  Stop stop_ = Stop::none;
  bool at_boundary_ = false;  ///< stopped ahead of the block at pc_
  uint32_t pc_ = 0;
  uint32_t pending_instructions_ = 0;
  Block float_block_;
  bool judging_ = true;  ///< the block hook decides; off while the head of a block is executed
  uint64_t instructions_ = 0;
  Cycles asleep_cycles_ = 0;
  uint32_t return_magic_ = 0;
  std::optional<Stall> stall_;
  bool interrupted_ = false, asleep_ = false, locked_up_ = false, held_ = false;
  std::string last_fault_;
  struct {
    uint32_t number = 0, status = 0, address = 0;
    const char* what = "";
  } fault_;
};

}  // namespace diastole::board_model
