#include "tools/sim_board/processor/cpu.hpp"

#include <algorithm>

#include "protocol/contract/input_error.hpp"

namespace diastole::board_model {
namespace {

constexpr uint32_t first_return_magic = 0xffff'ff00, return_page = 0xffff'f000;

// Numbers that the emulator gives to exceptions of the instruction stream.
constexpr uint32_t emulator_supervisor_call = 2, emulator_breakpoint = 7, emulator_exception_return = 8,
                   emulator_no_coprocessor = 17;

void check(uc_err result, const char* action) {
  if (result != UC_ERR_OK) {
    throw HardwareError("Unicorn", std::string(action) + ": " + uc_strerror(result),
                        "Install libunicorn2 2.0.1 as tools/setup does.");
  }
}

uc_engine* open_engine() {
  uc_engine* engine = nullptr;
  check(uc_open(UC_ARCH_ARM, static_cast<uc_mode>(UC_MODE_THUMB | UC_MODE_MCLASS), &engine), "open");
  check(uc_ctl_set_cpu_model(engine, UC_CPU_ARM_CORTEX_M4), "choose the Cortex-M4");
  return engine;
}

}  // namespace

Cpu::Cpu(CpuParts parts, FlashTiming timing)
    : parts_(parts),
      engine_(open_engine()),
      flash_blocks_(parts.memory.flash()),
      sram_blocks_(parts.memory.sram()),
      flash_access_(timing) {
  map_memory();
  add_hooks();
  parts_.control.on_protection_change([this] { protection_changed(); });
}

Cpu::~Cpu() = default;

void Cpu::map_memory() {
  const auto map = [&](uint32_t base, std::span<uint8_t> memory, uint32_t rights, const char* what) {
    check(uc_mem_map_ptr(engine_.get(), base, memory.size(), UC_PROT_ALL, memory.data()), what);
    // Taking rights away afterwards, not mapping without them, makes the emulator drop refused stores.
    check(uc_mem_protect(engine_.get(), base, memory.size(), rights), what);
  };
  Memory& memory = parts_.memory;
  map(flash_base, memory.flash(), UC_PROT_READ | UC_PROT_EXEC, "map flash");
  map(0, memory.flash(), UC_PROT_READ | UC_PROT_EXEC, "map the boot alias");
  map(sram_base, memory.sram(), UC_PROT_ALL, "map SRAM");
  map(ccm_base, memory.ccm(), UC_PROT_READ | UC_PROT_WRITE, "map CCM");
  map(backup_base, memory.backup(), UC_PROT_READ | UC_PROT_WRITE, "map backup SRAM");
  map(system_base, memory.system(), UC_PROT_READ, "map system memory");
  check(uc_mem_map(engine_.get(), return_page, 0x1000, UC_PROT_READ | UC_PROT_EXEC), "map the return page");

  windows_ = {{this, 0x4000'0000, 0x2'4000},
              {this, 0x4002'5000, 0x5'b000},
              {this, 0x5000'0000, 0x6'1000},
              {this, 0xe000'0000, 0x10'0000}};
  for (Window& window : windows_) {
    check(uc_mmio_map(engine_.get(), window.base, window.bytes, &Cpu::on_read, &window, &Cpu::on_write,
                      &window),
          "map registers");
  }
}

void Cpu::add_hooks() {
  const auto hook = [&](int kind, auto* function) {
    uc_hook handle = 0;
    check(uc_hook_add(engine_.get(), &handle, kind, reinterpret_cast<void*>(function), this, uint64_t{1},
                      uint64_t{0}),
          "add a hook");
  };
  hook(UC_HOOK_BLOCK, &Cpu::on_block);
  hook(UC_HOOK_INTR, &Cpu::on_interrupt);
  hook(UC_HOOK_MEM_UNMAPPED | UC_HOOK_MEM_WRITE_PROT | UC_HOOK_MEM_FETCH_PROT | UC_HOOK_MEM_READ_PROT,
       &Cpu::on_bad_access);
  if (!flash_access_.counts()) return;
  uc_hook handle = 0;
  check(uc_hook_add(engine_.get(), &handle, UC_HOOK_MEM_READ, reinterpret_cast<void*>(&Cpu::on_flash_read),
                    this, uint64_t{flash_base}, uint64_t{flash_base + flash_bytes - 1}),
        "add a hook");
}

void Cpu::protection_changed() { protection_stale_ = true; }

/// The emulator protects pages of 4 KB. SRAM is as the regions say; elsewhere they are not modelled.
void Cpu::apply_protection() {
  protection_stale_ = false;
  constexpr uint32_t page = 0x1000;
  check(uc_mem_protect(engine_.get(), sram_base, sram_bytes, UC_PROT_ALL), "protect memory");
  regions_ = parts_.control.protected_regions();
  for (const auto& region : regions_) {
    if (region.base % page != 0 || region.bytes % page != 0 || region.base - sram_base >= sram_bytes ||
        region.bytes > sram_bytes) {
      parts_.notes.add("a protected region outside SRAM or of less than a page is not modelled");
      continue;
    }
    const uint32_t rights = region.denied           ? uint32_t{UC_PROT_NONE}
                            : region.never_executed ? uint32_t{UC_PROT_READ | UC_PROT_WRITE}
                                                    : uint32_t{UC_PROT_ALL};
    check(uc_mem_protect(engine_.get(), region.base, region.bytes, rights), "protect memory");
  }
}

bool Cpu::denied(uint32_t address, uint32_t bytes) const {
  return std::ranges::any_of(regions_, [&](const auto& region) {
    return region.denied && address < region.base + region.bytes && address + bytes > region.base;
  });
}

uint32_t Cpu::get(int reg) {
  uint32_t value = 0;
  uc_reg_read(engine_.get(), reg, &value);
  return value;
}

void Cpu::set(int reg, uint32_t value) { uc_reg_write(engine_.get(), reg, &value); }

Masks Cpu::masks() { return {get(UC_ARM_REG_PRIMASK), get(UC_ARM_REG_BASEPRI), get(UC_ARM_REG_FAULTMASK)}; }

void Cpu::reset() {
  // IPSR first: leaving handler mode exchanges the stack pointers.
  set(UC_ARM_REG_IPSR, 0);
  set(UC_ARM_REG_CONTROL, 0);
  for (int reg = UC_ARM_REG_R0; reg <= UC_ARM_REG_R12; ++reg)
    set(reg, 0);
  set(UC_ARM_REG_PRIMASK, 0);
  set(UC_ARM_REG_BASEPRI, 0);
  set(UC_ARM_REG_FAULTMASK, 0);
  set(UC_ARM_REG_PSP, 0);
  set(UC_ARM_REG_MSP, parts_.memory.word(0).value_or(0) & ~3U);
  set(UC_ARM_REG_LR, 0xffff'ffff);
  set(UC_ARM_REG_XPSR_NZCVQG, 0x0100'0000);
  set(UC_ARM_REG_FPSCR, 0);
  pc_ = parts_.memory.word(4).value_or(0) & ~1U;
  pending_instructions_ = 0;
  interrupted_ = asleep_ = locked_up_ = false;
}

void Cpu::forget_code(uint32_t offset, uint32_t bytes) {
  flash_blocks_.forget(offset, bytes);
  // The translator removes whole pages at a time and stops at holes, hence page by page.
  constexpr uint32_t page = 0x1000;
  for (uint32_t at = offset & ~(page - 1); at < offset + bytes; at += page) {
    uc_ctl_remove_cache(engine_.get(), flash_base + at, flash_base + at + page);
    uc_ctl_remove_cache(engine_.get(), at, at + page);
  }
}

void Cpu::interrupt() {
  interrupted_ = true;
  stop(Stop::interrupted);
}

void Cpu::stop(Stop reason) {
  if (stop_ == Stop::none) stop_ = reason;
  uc_emu_stop(engine_.get());
}

void Cpu::finish_block() {
  parts_.clock.set_now(parts_.clock.now() + pending_instructions_ + pending_waits_);
  instructions_ += pending_instructions_;
  flash_wait_cycles_ += pending_waits_;
  pending_instructions_ = 0;
  pending_waits_ = 0;
}

void Cpu::on_block(uc_engine*, uint64_t address, uint32_t bytes, void* self) {
  static_cast<Cpu*>(self)->block(address, bytes);
}

void Cpu::block(uint64_t address, uint32_t bytes) {
  if (!judging_) return;
  finish_block();
  Clock& clock = parts_.clock;
  pc_ = static_cast<uint32_t>(address);
  at_boundary_ = true;
  if (stop_ != Stop::none) return stop(stop_);
  if (protection_stale_) return stop(Stop::protection_changed);
  if (pc_ >= first_return_magic) {
    return_magic_ = pc_ | 1;
    return stop(Stop::exception_return);
  }
  const bool in_flash = pc_ - flash_base < flash_bytes;
  if (in_flash && parts_.flash.busy_until() > clock.now())
    clock.set_now(std::min(parts_.flash.busy_until(), std::max(limit_, clock.now())));
  if (parts_.scheduler.next() <= clock.now()) parts_.scheduler.run_until(clock.now());
  if (stop_ != Stop::none) return stop(stop_);
  if (clock.now() >= limit_) return stop(Stop::limit);
  if (parts_.nvic.preempts_active() && parts_.nvic.deliverable(masks())) return stop(Stop::exception);

  const Block& found = in_flash                       ? flash_blocks_.at(pc_ - flash_base, bytes)
                       : pc_ - sram_base < sram_bytes ? sram_blocks_.at(pc_ - sram_base, bytes)
                                                      : flash_blocks_.at(pc_ % flash_bytes, bytes);
  if (found.before_float != Block::no_float && !parts_.control.fpu_enabled()) {
    float_block_ = found;
    return stop(Stop::float_disabled);
  }
  pending_instructions_ = found.instructions;
  if (in_flash && flash_access_.counts()) {
    flash_access_.set_control(parts_.flash.access_control());
    pending_waits_ = flash_access_.block(pc_ - flash_base, bytes, found.instructions);
  }
  at_boundary_ = false;
}

void Cpu::on_flash_read(uc_engine*, uc_mem_type, uint64_t address, int, int64_t, void* self) {
  Cpu& cpu = *static_cast<Cpu*>(self);
  cpu.pending_waits_ += cpu.flash_access_.read(static_cast<uint32_t>(address) - flash_base);
}

void Cpu::on_interrupt(uc_engine*, uint32_t number, void* self) {
  Cpu& cpu = *static_cast<Cpu*>(self);
  switch (number) {
    case emulator_supervisor_call:
      return cpu.stop(Stop::supervisor_call);
    case emulator_exception_return:
      cpu.return_magic_ = cpu.get(UC_ARM_REG_PC) | 1;
      return cpu.stop(Stop::exception_return);
    case emulator_breakpoint:
      cpu.fault_ = {exception::hard_fault, 0, 0, "breakpoint instruction without a debugger"};
      break;
    case emulator_no_coprocessor:
      cpu.fault_ = {exception::usage_fault, fault_status::no_coprocessor, 0,
                    "coprocessor that does not exist"};
      break;
    default:
      cpu.fault_ = {exception::bus_fault, fault_status::instruction_access, 0,
                    "instruction that cannot be executed"};
      break;
  }
  cpu.stop(Stop::fault);
}

bool Cpu::on_bad_access(uc_engine*, uc_mem_type type, uint64_t address, int bytes, int64_t value,
                        void* self) {
  Cpu& cpu = *static_cast<Cpu*>(self);
  const auto where = static_cast<uint32_t>(address);
  const bool in_ram = where - sram_base < sram_bytes;
  if (in_ram && (type == UC_MEM_WRITE_PROT || type == UC_MEM_READ_PROT || type == UC_MEM_FETCH_PROT)) {
    const bool executes = type == UC_MEM_FETCH_PROT;
    cpu.fault_ = {exception::mem_manage,
                  executes ? fault_status::execute_denied
                           : fault_status::data_denied | fault_status::denied_address_valid,
                  where, executes ? "execution from RAM that the MPU denies" : "access that the MPU denies"};
    if (cpu.stop_ == Stop::none) cpu.stop_ = Stop::fault;
    return false;
  }
  switch (type) {
    case UC_MEM_WRITE_PROT:
      if (where - flash_base < flash_bytes || where < flash_bytes) {
        cpu.parts_.flash.store(where % flash_bytes, static_cast<uint32_t>(value),
                               static_cast<uint32_t>(bytes));
        return true;  // the emulator itself drops stores to read-only memory
      }
      [[fallthrough]];
    case UC_MEM_WRITE_UNMAPPED:
      cpu.fault_ = {exception::bus_fault, fault_status::imprecise_data, where,
                    "store to an address that holds nothing"};
      break;
    case UC_MEM_READ_UNMAPPED:
      cpu.fault_ = {exception::bus_fault, fault_status::precise_data | fault_status::address_valid, where,
                    "load from an address that holds nothing"};
      break;
    default:
      cpu.fault_ = {exception::bus_fault, fault_status::instruction_access, where,
                    "jump to an address that holds no code"};
      break;
  }
  if (cpu.stop_ == Stop::none) cpu.stop_ = Stop::fault;
  return false;
}

uint64_t Cpu::on_read(uc_engine*, uint64_t offset, unsigned bytes, void* self) {
  const Window& window = *static_cast<Window*>(self);
  return window.cpu->parts_.bus.read(window.base + static_cast<uint32_t>(offset), bytes);
}

void Cpu::on_write(uc_engine*, uint64_t offset, unsigned bytes, uint64_t value, void* self) {
  const Window& window = *static_cast<Window*>(self);
  Cpu& cpu = *window.cpu;
  const uint32_t address = window.base + static_cast<uint32_t>(offset);
  cpu.parts_.bus.write(address, static_cast<uint32_t>(value), bytes);
  if (!cpu.stall_ || cpu.stall_->address != address) return;
  Clock& clock = cpu.parts_.clock;
  clock.set_now(clock.now() + cpu.stall_->cycles);
  cpu.stall_.reset();
  cpu.parts_.scheduler.run_until(clock.now());
}

void Cpu::run_until(Cycles limit) {
  limit_ = limit;
  while (!interrupted_ && parts_.clock.now() < limit) {
    if (locked_up_ || asleep_ || held_) {
      idle(limit);
      continue;
    }
    if (parts_.nvic.preempts_active() && parts_.nvic.deliverable(masks())) {
      enter(parts_.nvic.best_pending(), false);
      continue;
    }
    execute();
  }
}

void Cpu::idle(Cycles limit) {
  Clock& clock = parts_.clock;
  while (!interrupted_ && clock.now() < limit) {
    if (asleep_ && !held_ && parts_.nvic.best_pending() != 0 && parts_.nvic.wakes(masks())) {
      asleep_ = false;
      return;
    }
    const Cycles until = std::max(clock.now(), std::min(limit, parts_.scheduler.next()));
    if (asleep_) asleep_cycles_ += until - clock.now();
    clock.set_now(until);
    parts_.scheduler.run_until(clock.now());
  }
}

void Cpu::execute() {
  if (protection_stale_) apply_protection();
  stop_ = Stop::none;
  at_boundary_ = false;
  const uc_err result = uc_emu_start(engine_.get(), pc_ | 1, 0, 0, 0);
  finish_block();
  if (!at_boundary_) pc_ = get(UC_ARM_REG_PC) & ~1U;
  sort_out(result);
}

void Cpu::sort_out(uc_err result) {
  switch (stop_) {
    case Stop::limit:
    case Stop::interrupted:
    case Stop::exception:
    case Stop::protection_changed:
      return;
    case Stop::exception_return:
      return exception_return(return_magic_);
    case Stop::supervisor_call:
      return raise(exception::sv_call, 0, 0, "");
    case Stop::float_disabled:
      return run_to_float();
    case Stop::fault:
      return raise(fault_.number, fault_.status, fault_.address, fault_.what);
    case Stop::none:
      break;
  }
  const uint32_t before = parts_.memory.word((pc_ - 2) & ~3U).value_or(0) >> (((pc_ - 2) & 2) * 8) & 0xffff;
  if (result == UC_ERR_OK && before == 0xbf30) {
    asleep_ = true;
  } else if (result == UC_ERR_INSN_INVALID) {
    raise(exception::usage_fault, fault_status::undefined_instruction, 0, "undefined instruction");
  } else if (result == UC_ERR_EXCEPTION) {
    raise(exception::usage_fault, fault_status::invalid_state, 0, "jump to an even address");
  } else if (result != UC_ERR_OK) {
    raise(exception::hard_fault, 0, 0, uc_strerror(result));
  }
}

/// The FPU is off and the block ahead needs it: execute what precedes and fault at the instruction itself.
void Cpu::run_to_float() {
  if (float_block_.before_float > 0) {
    const uint32_t until = pc_ + float_block_.bytes_before_float;
    judging_ = false;
    // Translated anew, the block ends at `until`.
    uc_ctl_remove_cache(engine_.get(), pc_, pc_ + float_block_.bytes);
    uc_emu_start(engine_.get(), pc_ | 1, until, 0, 0);
    judging_ = true;
    pc_ = until;
    pending_instructions_ = float_block_.before_float;
    finish_block();
  }
  raise(exception::usage_fault, fault_status::no_coprocessor, 0,
        "floating point while CPACR keeps the FPU off");
}

}  // namespace diastole::board_model
