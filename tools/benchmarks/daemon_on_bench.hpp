#pragma once
// A daemon in real time with the simulated instrument, before the simulated rig's controller, and what it costs.

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "host/rpc/client.hpp"
#include "tools/benchmarks/line_tap.hpp"
#include "tools/benchmarks/process_figures.hpp"
#include "tools/diastole/simulate/child_process.hpp"

namespace diastole {

struct BenchLoad {
  int channels = 10;
  double rate_Hz = 10'000;
};

class DaemonOnBench {
 public:
  /// In a directory of its own on the disk of `below`, gone afterwards. Returns when the daemon serves and the pump is
  /// homed. Throws HardwareError or InputError as the programs put it.
  DaemonOnBench(const BenchLoad& load, const std::filesystem::path& below);
  ~DaemonOnBench();
  DaemonOnBench(const DaemonOnBench&) = delete;
  DaemonOnBench& operator=(const DaemonOnBench&) = delete;

  [[nodiscard]] DaemonClient client() const { return DaemonClient(directory_ / "socket"); }
  /// The console's address, with the token for control.
  [[nodiscard]] const std::string& console() const { return console_; }
  [[nodiscard]] ProcessFigures figures() const { return figures_of(daemon_->pid()); }
  [[nodiscard]] LineTap& tap() { return *tap_; }

  /// Starts a run of the pump's slow cycles that lasts some `seconds`. Returns how long it records, in seconds: rest,
  /// cycles, and the quarter of a second after them.
  double start_run(DaemonClient& client, double seconds) const;
  /// Waits for the run's end and its file; returns run.progress. Removes journal and run file.
  static nlohmann::json await_end(DaemonClient& client);

 private:
  BenchLoad load_;
  std::filesystem::path directory_;
  std::string console_;
  std::unique_ptr<ChildProcess> rig_;
  std::unique_ptr<LineTap> tap_;
  std::unique_ptr<ChildProcess> daemon_;  // ends first
};

}  // namespace diastole
