#pragma once
// The real image on an emulated chip that can be hurt: supply, crystal, code; and the daemon's own client before it.

#include <algorithm>
#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/flash/elf_symbols.hpp"
#include "tests/tools/sim_board/built_firmware.hpp"
#include "tests/tools/sim_board/emulated_desk.hpp"

namespace diastole::sim_board_test {

class ChipBench {
 public:
  explicit ChipBench(SimBoardOptions options = {})
      : desk(firmware, options), client(desk, rig, [this] { return std::make_unique<EmulatedLine>(desk); }) {}

  void pass(uint64_t time_ns) { desk.sleep_until_ns(desk.now_ns() + time_ns, nullptr); }
  void connect(uint64_t after_ms = 500) {
    pass(after_ms * ms);
    client.connect();
  }
  [[nodiscard]] SimBoard& board() { return desk.controller.board(); }
  [[nodiscard]] bool motor_is_on() { return board().level(diastole_wiring().enable.pin); }
  /// Settings that can be told from each other.
  static wire::MachineSettings numbered(int number) {
    wire::MachineSettings settings;
    settings.backlash_nm = number;
    return settings;
  }
  /// Replaces the first instructions of a function of the running image. Precondition: it has the function.
  void patch(const std::string& function, const std::vector<uint16_t>& code) {
    desk.planted = "fault: ";
    replaced_at_ = symbols.address_of(function).value();
    std::vector<uint8_t> bytes(2 * code.size());
    std::memcpy(bytes.data(), code.data(), bytes.size());
    const auto before = board().flash().subspan(replaced_at_ - 0x0800'0000, bytes.size());
    replaced_.assign(before.begin(), before.end());
    board().load(bytes, replaced_at_);
  }
  /// Puts back what was there, so that the image verifies again.
  void restore() { board().load(replaced_, replaced_at_); }
  /// The registers of the crash that the black box tells.
  std::map<wire::CrashRegister, uint32_t> crash() {
    std::map<wire::CrashRegister, uint32_t> found;
    for (const wire::BlackBoxEntry& entry : client.black_box())
      if (entry.kind == wire::Noted::crash)
        found[static_cast<wire::CrashRegister>(entry.detail)] = static_cast<uint32_t>(entry.argument);
    return found;
  }

  RigConfig rig = read_rig(std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples/rig.toml");
  ElfSymbols symbols{firmware};
  EmulatedDesk desk;
  ControllerClient client;

 private:
  std::vector<uint8_t> replaced_;
  uint32_t replaced_at_ = 0;
};

}  // namespace diastole::sim_board_test
