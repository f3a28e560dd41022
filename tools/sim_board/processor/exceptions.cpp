// Exception entry and return of the core (ARMv7-M ARM, B1.5.6 to B1.5.8).
//
//   frame, upwards from the new stack pointer:
//     r0 r1 r2 r3 r12 lr pc xpsr                          32 bytes
//     then, when the FPU was in use: s0 ... s15 fpscr -   72 bytes more
//   xpsr bit 9 says that 4 bytes were left out to align the frame to 8.

#include <array>
#include <cstdio>

#include "tools/sim_board/processor/cpu.hpp"

namespace diastole::board_model {
namespace {

constexpr Cycles entry_cycles = 12, return_cycles = 10, chain_cycles = 6;
constexpr uint32_t basic_frame_bytes = 32, float_frame_bytes = 104;
constexpr uint32_t stack_select = 2, float_active = 4;  // CONTROL
constexpr uint32_t padded = 1 << 9, thumb_state = 1 << 24;
constexpr uint32_t magic_thread = 1 << 3, magic_process_stack = 1 << 2, magic_basic_frame = 1 << 4;

constexpr std::array<int, 6> stacked{UC_ARM_REG_R0, UC_ARM_REG_R1,  UC_ARM_REG_R2,
                                     UC_ARM_REG_R3, UC_ARM_REG_R12, UC_ARM_REG_LR};

}  // namespace

void Cpu::enter(uint32_t number, bool chained) {
  const Stacked stacked_frame = chained ? Stacked::done : stack_frame();
  if (stacked_frame == Stacked::no_memory)
    return lock_up("stacking failed: the stack pointer is outside RAM");
  if (stacked_frame == Stacked::denied) {
    // A derived fault (B1.5.7): the frame is not there, and the fault of stacking it is what is taken.
    parts_.control.record_fault(fault_status::stacking_denied);
    if (number != exception::mem_manage && number != exception::hard_fault)
      number =
          parts_.control.fault_enabled(exception::mem_manage) ? exception::mem_manage : exception::hard_fault;
  }
  const auto vector = parts_.memory.word(parts_.control.vector_table() + 4 * number);
  parts_.clock.set_now(parts_.clock.now() + (chained ? chain_cycles : entry_cycles));
  parts_.nvic.enter(number, instructions_);
  set(UC_ARM_REG_LR, return_magic_);
  set(UC_ARM_REG_XPSR_NZCVQG, thumb_state | number);
  if (!vector || (*vector & 1) == 0) return lock_up("the vector table holds no handler for this exception");
  pc_ = *vector & ~1U;
}

/// Pushes the frame and sets return_magic_. Denied: the stack pointer has moved, nothing is written.
Cpu::Stacked Cpu::stack_frame() {
  const uint32_t control = get(UC_ARM_REG_CONTROL);
  const bool thread = parts_.nvic.running() == 0;
  const bool with_float = (control & float_active) != 0;
  const uint32_t bytes = with_float ? float_frame_bytes : basic_frame_bytes;
  const uint32_t before = get(UC_ARM_REG_SP);
  const uint32_t frame = (before - bytes) & ~7U;
  if (parts_.memory.at(frame, bytes).empty()) return Stacked::no_memory;

  const bool refused = denied(frame, bytes);
  uint32_t at = frame;
  const auto push = [&](uint32_t value) {
    if (!refused) parts_.memory.set_word(at, value);
    at += 4;
  };
  for (const int reg : stacked)
    push(get(reg));
  push(pc_);
  push(((get(UC_ARM_REG_XPSR) | thumb_state) & ~padded) | ((before & 4) != 0 ? padded : 0));
  if (with_float) {
    for (int reg = UC_ARM_REG_S0; reg < UC_ARM_REG_S0 + 16; ++reg)
      push(get(reg));
    push(get(UC_ARM_REG_FPSCR));
    set(UC_ARM_REG_CONTROL, control & ~float_active);
  }
  set(UC_ARM_REG_SP, frame);
  return_magic_ = 0xffff'ffe1 | (with_float ? 0 : magic_basic_frame) | (thread ? magic_thread : 0) |
                  (thread && (control & stack_select) != 0 ? magic_process_stack : 0);
  return refused ? Stacked::denied : Stacked::done;
}

void Cpu::exception_return(uint32_t magic) {
  const uint32_t number = parts_.nvic.running();
  if (number != exception::nmi) set(UC_ARM_REG_FAULTMASK, 0);
  if (!parts_.nvic.leave(number, instructions_)) return lock_up("exception return in thread mode");
  if (parts_.nvic.preempts_active() && parts_.nvic.deliverable(masks())) {
    return_magic_ = magic;
    return enter(parts_.nvic.best_pending(), true);
  }
  if (!unstack_frame(magic)) return lock_up("unstacking failed: the stack pointer is outside RAM");
  parts_.clock.set_now(parts_.clock.now() + return_cycles);
  if (parts_.control.sleep_on_exit() && parts_.nvic.running() == 0) asleep_ = true;
}

bool Cpu::unstack_frame(uint32_t magic) {
  const bool with_float = (magic & magic_basic_frame) == 0;
  const uint32_t bytes = with_float ? float_frame_bytes : basic_frame_bytes;
  const bool process_stack = (magic & magic_process_stack) != 0;
  const uint32_t frame = get(process_stack ? UC_ARM_REG_PSP : UC_ARM_REG_MSP);
  if (parts_.memory.at(frame, bytes).empty()) return false;

  uint32_t at = frame;
  const auto pop = [&] {
    const uint32_t value = parts_.memory.word(at).value_or(0);
    at += 4;
    return value;
  };
  for (const int reg : stacked)
    set(reg, pop());
  pc_ = pop() & ~1U;
  const uint32_t status = pop();
  if (with_float) {
    for (int reg = UC_ARM_REG_S0; reg < UC_ARM_REG_S0 + 16; ++reg)
      set(reg, pop());
    set(UC_ARM_REG_FPSCR, pop());
  }
  const uint32_t control = get(UC_ARM_REG_CONTROL) & ~float_active;
  set(UC_ARM_REG_CONTROL, control | (with_float ? float_active : 0));
  set(process_stack ? UC_ARM_REG_PSP : UC_ARM_REG_MSP, frame + bytes + ((status & padded) != 0 ? 4 : 0));
  // Last, as leaving handler mode exchanges the stack pointers.
  set(UC_ARM_REG_XPSR_NZCVQG, status & ~padded);
  return true;
}

void Cpu::raise(uint32_t number, uint32_t status_bits, uint32_t address, const char* what) {
  parts_.control.record_fault(status_bits, address);
  if (number != exception::sv_call) {
    char text[160];
    std::snprintf(text, sizeof text, "%s (address 0x%08x) at or after pc 0x%08x", what, address, pc_);
    last_fault_ = text;
    parts_.notes.add("fault: " + last_fault_);
  }
  const Masks held = masks();
  if (number != exception::hard_fault && parts_.control.fault_enabled(number) &&
      parts_.nvic.could_take(number, held)) {
    return enter(number, false);
  }
  if (number != exception::hard_fault) parts_.control.record_escalation();
  if (!parts_.nvic.could_take(exception::hard_fault, held))
    return lock_up("a fault within the hard-fault handler");
  enter(exception::hard_fault, false);
}

void Cpu::lock_up(const char* why) {
  locked_up_ = true;
  last_fault_ = std::string("lockup: ") + why;
  parts_.notes.add(last_fault_);
}

}  // namespace diastole::board_model
