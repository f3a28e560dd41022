#pragma once
// The cavity's true volume, as a scanner that never errs would gate it: one row every 4 ms at the most,
//
//   trigger,since_s,cavity_mL
//
// trigger: number of the last rising edge of the TTL, from 0 when the rig was switched on; nothing before the first.

#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>

#include "protocol/contract/input_error.hpp"

namespace diastole::sim_rig {

class VolumeTrace {
 public:
  /// Throws InputError if the file cannot be written.
  explicit VolumeTrace(const std::filesystem::path& path) : file_(path) {
    file_ << "trigger,since_s,cavity_mL\n";
    if (!file_.flush())
      throw InputError(
          {path.string(), "", "cannot be written", "Name a file in a folder that exists for --volume."});
  }

  void begin_cycle(uint64_t time_ns) {
    trigger_ns_ = time_ns;
    ++triggers_;
  }
  void take(uint64_t now_ns, double cavity_mL) {
    constexpr uint64_t interval_ns = 4'000'000;
    if (!trigger_ns_ || now_ns < next_ns_) return;
    next_ns_ = now_ns + interval_ns;
    file_ << fmt::format("{},{:.6f},{:.6f}\n", triggers_ - 1,
                         1e-9 * static_cast<double>(now_ns - *trigger_ns_), cavity_mL);
    file_.flush();  // whoever reads it does so between two sessions
  }

 private:
  std::ofstream file_;
  std::optional<uint64_t> trigger_ns_;
  uint64_t triggers_ = 0;
  uint64_t next_ns_ = 0;
};

}  // namespace diastole::sim_rig
