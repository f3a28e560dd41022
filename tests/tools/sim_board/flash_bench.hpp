#pragma once
// An emulated board that left the factory, and `diastole flash` in its virtual time.

#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "host/flash/update_link.hpp"
#include "host/flash/updater.hpp"
#include "tests/tools/sim_board/emulated_desk.hpp"

namespace diastole::sim_board_test {

const std::string built = DIASTOLE_SOURCE_DIR "/build/firmware/";
const std::string factory_image = built + "bin/diastole-stm32f405.bin";
const std::string first_update = built + "bin/diastole-stm32f405.image";
const std::string newer_update = built + "tests/newer.image";
const std::string hanging_update = built + "tests/hanging.image";

#define NEEDS_UPDATE_IMAGES()                                                                 \
  for (const std::string& file : {factory_image, first_update, newer_update, hanging_update}) \
    if (!std::filesystem::exists(file)) GTEST_SKIP() << "no " << file << ": build the preset `firmware` first"

/// True if the host's own reading of the slot finds an image that verifies.
inline bool verifies(std::span<const uint8_t> flash, wire::ImageSlot slot) {
  const auto bytes = flash.subspan(slot == wire::ImageSlot::a ? 0x2'0000 : 0x4'0000, 0x2'0000);
  const auto header = wire::decode_image_header(bytes.first<wire::kImageHeaderBytes>());
  if (!header || header->code_bytes > bytes.size() - wire::kImageHeaderArea) return false;
  return wire::digest_of(*header, bytes.subspan(wire::kImageHeaderArea, header->code_bytes)) ==
         header->sha256;
}

class FlashBench {
 public:
  explicit FlashBench(const std::string& image = factory_image, SimBoardOptions options = {})
      : desk(image, options), line_(desk) {}

  UpdateResult flash(const std::string& file, const UpdateOptions& options = {}) {
    return flash(read_update_file(file), options);
  }
  UpdateResult flash(const UpdateFile& file, const UpdateOptions& options = {}) {
    return flash_controller(desk, line_, "the emulated board", file, options);
  }
  /// What answers on the line: an application's report of itself, or a bootloader's (slot none).
  std::optional<wire::ImageReport> running() {
    UpdateLink link(desk, line_);
    link.pause(35 * ms);  // a bootloader listens for one word only
    for (int attempt = 0; attempt < 8; ++attempt) {
      if (!link.open(60 * ms)) continue;
      const auto report =
          link.ask<wire::ImageReport>(wire::ImageQuery{.slot = wire::ImageSlot::none}, 300 * ms);
      if (report) return report;
    }
    return {};
  }
  /// "0.1.0 confirmed", or "bootloader", or "silence".
  std::string runs() {
    const auto report = running();
    if (!report) return "silence";
    if (report->slot == wire::ImageSlot::none) return "bootloader";
    const std::string version =
        in_words({report->version_major, report->version_minor, report->version_patch});
    return version + (report->standing == wire::ImageState::confirmed ? " confirmed" : " unconfirmed");
  }
  [[nodiscard]] SimBoard& board() { return desk.controller.board(); }
  /// A board that takes anybody's firmware: starts judge no signature. It must be off.
  void remove_key() {
    std::array<uint8_t, 32> erased{};
    erased.fill(0xff);
    board().load(erased, 0x0800'3FE0);
  }
  void power_cycle() {
    board().power_cycle();
    desk.to_host.clear();
  }

  EmulatedDesk desk;

 private:
  EmulatedLine line_;
};

}  // namespace diastole::sim_board_test
