#pragma once
// A rig on the desk: the real controller firmware on the recording board, behind a ByteLine, with a Clock
// that advances it. No threads, no devices; equal calls give equal runs.

#include <deque>
#include <functional>
#include <memory>

#include "firmware/boards/recording/recorded_controller.hpp"
#include "host/config/rig_config.hpp"
#include "host/daq/instrument.hpp"
#include "host/transport/clock.hpp"

namespace diastole {

/// What both ends of the desk share.
struct Desk {
  std::unique_ptr<firmware::RecordedController> controller = std::make_unique<firmware::RecordedController>();
  std::deque<uint8_t> to_host;
  uint64_t now_ns = 0;
  bool plugged = true;

  void advance_to(uint64_t until_ns);
  void reset_controller() { controller = std::make_unique<firmware::RecordedController>(); }

  uint64_t controller_started_ns = 0;  ///< when the controller was last reset
};

class DeskLine final : public ByteLine {
 public:
  explicit DeskLine(Desk& desk) : desk_(desk) { desk_.to_host.clear(); }
  void write(std::span<const uint8_t> bytes) override;
  size_t read(std::span<uint8_t> out) override;
  void flush(int) override {}
  void wait_received(uint64_t, int) override {}
  [[nodiscard]] bool lost() const override { return !desk_.plugged; }
  [[nodiscard]] uint64_t written_total() const override { return 0; }
  [[nodiscard]] uint64_t received_total() const override { return 0; }
  [[nodiscard]] int descriptor() const override { return -1; }

 private:
  Desk& desk_;
};

class DeskClock final : public Clock {
 public:
  explicit DeskClock(Desk& desk) : desk_(desk) {}
  [[nodiscard]] uint64_t now_ns() override { return desk_.now_ns; }
  void sleep_until_ns(uint64_t until_ns, ByteLine*) override {
    desk_.advance_to(until_ns);
    ++turns;
    if (each_turn) each_turn();
  }
  [[nodiscard]] bool stands_still() const override { return true; }

  uint64_t turns = 0;
  std::function<void()> each_turn;

 private:
  Desk& desk_;
};

/// Reads 0.5 V + 0.1 V a second of desk time; fails and takes its time as it is told.
class DeskInstrument final : public daq::PolledInstrument {
 public:
  explicit DeskInstrument(Desk& desk) : desk_(desk) {}
  [[nodiscard]] std::string describe() const override { return "desk instrument"; }
  [[nodiscard]] size_t channels() const override { return 1; }
  daq::Outcome read(std::span<double> volts) override;
  std::optional<uint32_t> read_timer() override;
  [[nodiscard]] double timer_rate_Hz() const override { return 40e6; }

  uint64_t readings = 0;
  std::function<daq::Outcome(uint64_t reading)> fault = [](uint64_t) { return daq::Outcome{}; };
  std::function<uint64_t(uint64_t reading)> delay_ns = [](uint64_t) { return uint64_t{0}; };
  std::function<double(double time_s)> volts_at = [](double time_s) { return 0.5 + 0.1 * time_s; };
  double clock_error_ppm = 0;

 private:
  Desk& desk_;
};

/// examples/rig.toml.
RigConfig example_rig();

}  // namespace diastole
