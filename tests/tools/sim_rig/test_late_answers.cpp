// A conducted daemon's driver and clock against a rig whose instrument answers late or not at all.

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <nlohmann/json.hpp>
#include <thread>

#include "host/transport/conducted_clock.hpp"
#include "tests/host/bench/scratch.hpp"
#include "tests/host/daq/configured.hpp"
#include "tests/tools/sim_rig/scripted_controller.hpp"
#include "tools/sim_rig/control_client.hpp"
#include "tools/sim_rig/server.hpp"

namespace diastole::sim_rig {
namespace {

class LateAnswers : public testing::Test {
 protected:
  explicit LateAnswers(double host_drift_ppm = 0) {
    options_.conductor = scratch_ / "time";
    options_.control = scratch_ / "control";
    options_.host_drift_ppm = host_drift_ppm;
    server_ = std::make_unique<Server>(
        read_rig_description(TableReader::from_text(default_rig_toml(), "the built-in rig file")),
        std::make_unique<ScriptedController>(std::vector<sim_controller::PinEdge>{}), options_);
    EXPECT_EQ(::pipe(stop_.data()), 0);
    thread_ = std::thread([this] { server_->run(stop_[0]); });
    clock_.emplace(options_.conductor.string());
    const auto at = nlohmann::json::parse(server_->addresses());
    const auto open = daq::configured(daq::modbus_tcp_driver.configure,
                                      "host = \"127.0.0.1\"\nport = " + at["modbus_port"].dump() +
                                          "\npreset = \"labjack-t\"\ntimeout_ms = 20\n",
                                      "[[daq.channel]]\ninput = 0\n");
    instrument_ = open({.least_timeout_ms = 60'000, .now_ns = [this] { return clock_->now_ns(); }});
    control_.emplace(options_.control.string());
  }
  ~LateAnswers() override {
    EXPECT_EQ(::write(stop_[1], "x", 1), 1);
    thread_.join();
    for (const int fd : stop_)
      ::close(fd);
  }

  /// How a reading goes, and how much simulated time it takes.
  std::pair<daq::Outcome, double> read_ms() {
    const uint64_t asked_ns = clock_->now_ns();
    std::array<double, 1> volts{};
    const daq::Outcome outcome = instrument_->read(volts);
    return {outcome, 1e-6 * static_cast<double>(clock_->now_ns() - asked_ns)};
  }

  Scratch scratch_{"late"};
  ServerOptions options_;
  std::unique_ptr<Server> server_;
  std::array<int, 2> stop_{};
  std::thread thread_;
  std::optional<ConductedClock> clock_;
  std::unique_ptr<daq::PolledInstrument> instrument_;
  std::optional<ControlClient> control_;
};

TEST_F(LateAnswers, CostTheirTimeOnTheRigsClockAndAreTaken) {
  control_->order("fault on daq-delay 0.005");
  for (int i = 0; i < 200; ++i) {
    const auto [outcome, took_ms] = read_ms();
    ASSERT_TRUE(outcome.ok) << outcome.fault;
    ASSERT_DOUBLE_EQ(took_ms, 5);
  }
  clock_->sleep_until_ns(clock_->now_ns() + 1'000'000, nullptr);
  EXPECT_EQ(clock_->now_ns(), 1'001'000'000U);
}

TEST_F(LateAnswers, ThatNeverComeAreWaitedForOnTheRigsClock) {
  for (const std::string fault : {"daq-stall", "daq-delay"}) {
    control_->order("fault on " + fault);  // the delay is usually 50 ms
    for (int i = 0; i < 20; ++i) {
      const auto [outcome, took_ms] = read_ms();
      EXPECT_EQ(outcome.fault, "no answer within 20 ms");
      EXPECT_NEAR(took_ms, 20, 1e-6);
    }
    control_->order("fault off " + fault);
    EXPECT_TRUE(read_ms().first.ok);
  }
}

class LateAnswersToASlowClock : public LateAnswers {
 protected:
  LateAnswersToASlowClock() : LateAnswers(-100) {}
};

TEST_F(LateAnswersToASlowClock, AreToldAsTimeOutsToo) {
  control_->order("fault on daq-stall");
  EXPECT_EQ(read_ms().first.fault, "no answer within 20 ms");
}

}  // namespace
}  // namespace diastole::sim_rig
