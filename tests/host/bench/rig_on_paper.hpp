#pragma once
// A rig without controller, instrument and threads: it answers at once, after what RigService's thread does with an order's numbers and
// texts before anything moves. Equal orders are answered alike.

#include <cmath>
#include <functional>
#include <stdexcept>

#include "host/calibration/calibration.hpp"
#include "host/controller/settings_values.hpp"
#include "host/controller/wire_program.hpp"
#include "host/rig/rig.hpp"

namespace diastole {

class RigOnPaper final : public Rig {
 public:
  /// In a run that waits for the operator. `config` outlives it.
  explicit RigOnPaper(const RigConfig& config) : config_(config), book_({}, config.daq.channels) {
    run_.begin({.run_id = "run-1", .planned_s = 60, .estimate_s = 60, .planned_cycles = 50});
    RunProgress progress;
    progress.schedule = ScheduleProgress{"tagged", 1, 2, "waiting", 0, "Set slice 2."};
    run_.progress(progress);
    run_.remark({"info", "begun", "the run has begun"});
    live_.begin("run-1", 100, 1e6);
    live_.run_started(0);
    live_.clock({});
    live_.sample(10'000'000, 1.5, 1.5);
    live_.gap();
    live_.trigger(0);
  }

  void start_run(RunOrder order, Done done) override {
    answer(done, [&]() -> RigAnswer {
      Experiment& experiment = order.experiment;
      if (order.resume && experiment.schedule && experiment.schedule->slices() > 1)
        leave_out(experiment, {0});
      (void)reported_rate_Hz(experiment, config_.controller);
      for (const ExperimentWaveform& waveform : experiment.waveforms)
        (void)waveform_batches(waveform.even.rises);
      for (size_t index = 0; index < experiment.segments.size(); ++index)
        (void)segment_message(experiment, index);
      (void)arm_message(experiment, config_);
      (void)doubts_about(experiment);
      return RunBegun{"run-2", "run-2.journal", "run-2.run.h5"};
    });
  }
  void home(Done done) override { status(std::move(done)); }
  void clear_fault(Done done) override { status(std::move(done)); }
  void jog(double distance_mL, double rate_mL_s, Done done) override {
    answer(done, [&]() -> RigAnswer {
      require(std::isfinite(distance_mL));
      (void)whole({"", "--rate-mL-s", 1e3 * rate_mL_s, "uL/s", 1, 10'000'000});
      RigStatus result = homed();
      result.jog = {distance_mL, false};
      return result;
    });
  }
  void settings(Done done) override {
    done(nullptr, SettingsReport{.settings = settings_values(settings_), .problem = {}});
  }
  void write_settings(SettingsChange change, Done done) override {
    answer(done, [&]() -> RigAnswer {
      wire::MachineSettings changed = change.defaults ? wire::MachineSettings{} : settings_;
      change_settings(changed, change.set);
      settings_ = changed;
      return SettingsReport{.settings = settings_values(settings_), .problem = {}};
    });
  }
  void black_box(Done done) override { done(nullptr, BlackBox{{wire::BlackBoxEntry{}}, 1e6}); }
  void self_test(double seconds, Done done) override {
    answer(done, [&]() -> RigAnswer {
      require(seconds >= 2 && seconds <= 600);
      return SelfTestResult{};
    });
  }
  void calibrate(CalibrationOrder order, Done done) override {
    answer(done, [&]() -> RigAnswer {
      require(order.seconds >= 1 && order.seconds <= 600 && std::isfinite(order.kPa.value_or(0)));
      CalibrationReport report;
      for (const std::string& channel : order.channels) {
        const CalibrationPoint point{1.25, order.kPa.value_or(0), "2026-11-21T09:00:00Z",
                                     order.operator_name};
        order.kPa ? book_.add_point(channel, point) : book_.set_zero(channel, point);
        report.channels.push_back({.name = channel, .points = book_.of(channel).points.size()});
      }
      return report;
    });
  }
  void status(Done done) override { done(nullptr, homed()); }
  bool stop(StopRequest) override { return true; }
  void note(const RunRemark& what) override { run_.note(what); }
  [[nodiscard]] RunMonitor& run() override { return run_; }
  [[nodiscard]] const LiveTrace& live() const override { return live_; }

 private:
  static void answer(const Done& done, const std::function<RigAnswer()>& act) {
    RigAnswer answer;
    std::exception_ptr error;
    try {
      answer = act();
    } catch (...) {
      error = std::current_exception();
    }
    done(error, answer);
  }
  /// What the methods must have refused.
  static void require(bool holds) {
    if (!holds) throw std::logic_error("an order that no method may give");
  }
  [[nodiscard]] static RigStatus homed() {
    RigStatus status;
    status.state = "homed";
    return status;
  }

  const RigConfig& config_;
  CalibrationBook book_;
  wire::MachineSettings settings_;
  RunMonitor run_;
  LiveTrace live_;
};

}  // namespace diastole
