#pragma once
// The simulated rig and a daemon that works with it, started beside each other in a private directory.

#include <filesystem>
#include <memory>
#include <string>

#include "tools/diastole/simulate/child_process.hpp"

namespace diastole {

/// A directory of one's own for sockets, the serial line's link, logs and journals; gone afterwards.
class PrivateDirectory {
 public:
  PrivateDirectory();
  ~PrivateDirectory();
  PrivateDirectory(const PrivateDirectory&) = delete;
  PrivateDirectory& operator=(const PrivateDirectory&) = delete;

  [[nodiscard]] std::filesystem::path operator/(const char* name) const { return path_ / name; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Leaves it in place, because it holds something that must not be lost.
  void keep() { kept_ = true; }

 private:
  std::filesystem::path path_;
  bool kept_ = false;
};

struct SimulatedRigOptions {
  std::string config;  ///< rig file; empty: the built-in one
  std::string image;   ///< firmware image for the emulated board; empty: the firmware built for this machine
  std::string pins;    ///< pin trace to write; empty: none
  uint64_t seed = 1;
  bool real_time = false;
  std::vector<std::string> more = {};  ///< arguments for sim_rig
};

class SimulatedRig {
 public:
  /// Returns when the daemon serves. Throws InputError or HardwareError as the programs put it.
  SimulatedRig(const PrivateDirectory& directory, const SimulatedRigOptions& options);

  [[nodiscard]] std::string socket() const { return directory_ / "daemon.socket"; }
  /// Ends daemon and rig; the pin trace is complete then. Throws HardwareError if it is not.
  void stop();

 private:
  const PrivateDirectory& directory_;
  std::unique_ptr<ChildProcess> rig_;
  std::unique_ptr<ChildProcess> daemon_;  // ends first
};

}  // namespace diastole
