#pragma once
// Replacing the controller's firmware, from the first question to the confirmation:
//
//   const UpdateFile file = read_update_file("diastole-stm32f405.image");
//   UpdateResult result = flash_controller(clock, line, "/dev/ttyUSB0", file, options);
//
// Throws InputError if the file is not for this controller, HardwareError if the controller does not answer or does
// not do what it should; either way it still has a firmware that starts. What was sent stays: the same call again
// goes on from there.

#include <functional>
#include <optional>
#include <string>

#include "host/flash/update_file.hpp"
#include "host/transport/byte_line.hpp"
#include "host/transport/clock.hpp"

namespace diastole {

struct UpdateOptions {
  bool allow_older = false;
  bool force = false;  ///< also what it already runs
  bool dry_run = false;
  /// Bytes in the slot, and bytes in all; called as they grow.
  std::function<void(uint32_t held, uint32_t total)> progress = [](uint32_t, uint32_t) {};
  /// What is happening, for a person.
  std::function<void(const std::string&)> say = [](const std::string&) {};
  /// True ends the upload at the next chance.
  std::function<bool()> stop_asked = [] { return false; };
};

enum class UpdateEnd { confirmed, already_there, dry_run, stopped };

struct UpdateResult {
  UpdateEnd end = UpdateEnd::confirmed;
  std::optional<wire::FirmwareVersion> before;  ///< what ran; nothing if only the bootloader did
  uint32_t image_bytes = 0;                     ///< code of the image
  uint32_t sent_bytes = 0;                      ///< less than image_bytes if it was resumed
  uint32_t held_bytes = 0;                      ///< in the slot when it ended
  bool verified = false;                        ///< read back by the controller, hash equal
};

/// `port` is for messages.
UpdateResult flash_controller(Clock& clock, ByteLine& line, const std::string& port, const UpdateFile& file,
                              const UpdateOptions& options);

}  // namespace diastole
