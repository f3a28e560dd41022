#include "tests/tools/benchmarks/random_cuts.hpp"

#include <algorithm>
#include <random>
#include <vector>

#include "protocol/wire/wire_text.hpp"
#include "tests/tools/benchmarks/image.hpp"
#include "tools/benchmarks/emulated_session.hpp"
#include "tools/benchmarks/step_rate.hpp"
#include "tools/sim_board/emulated_controller.hpp"

namespace diastole::step_path_test {
namespace {

using sim_controller::Pin;

enum class Input { estop, far_limit, home };

wire::Fault fault_of(Input input) {
  return input == Input::estop       ? wire::Fault::estop
         : input == Input::far_limit ? wire::Fault::limit_switch
                                     : wire::Fault::home_switch;
}

void drive(EmulatedController& controller, Input input, bool active, uint64_t time_ns) {
  const Wiring& wiring = diastole_wiring();
  const Wire& wire = input == Input::estop       ? wiring.estop
                     : input == Input::far_limit ? wiring.far_limit
                                                 : wiring.home;
  controller.board().drive(wire.pin, active == wire.active_high, time_ns);
}

wire::Configure quick_to_stop_and_home() {
  wire::Configure configure = fine_stepping();
  configure.acceleration_uL_per_s2 = 200'000;
  configure.homing_flow_uL_per_s = 60;
  return configure;
}

class RandomCuts {
 public:
  explicit RandomCuts(uint32_t seed) : random_(seed), session_(image) {
    session_.on_edge = [this](const sim_controller::PinEdge& edge) {
      if (edge.pin != Pin::step) return;
      if (edge.value == 1)
        steps_ns_.push_back(rose_ns_ = edge.time_ns);
      else
        figures_.shortest_pulse_ns = std::min(figures_.shortest_pulse_ns, edge.time_ns - rose_ns_);
    };
  }

  CutFigures run(int trials) {
    EXPECT_TRUE(session_.prepare(quick_to_stop_and_home()));
    session_.flood = true;
    for (int trial = 0; trial < trials && !testing::Test::HasFailure(); ++trial) {
      const StepRateTrial motion = random_motion();
      SCOPED_TRACE(testing::Message() << "trial " << trial << ", " << motion);
      cut(motion, static_cast<Input>(below(3)));
      recover();
    }
    return figures_;
  }

 private:
  uint32_t below(uint32_t bound) { return static_cast<uint32_t>(random_() % bound); }

  StepRateTrial random_motion() {
    static constexpr wire::Waveform waveforms[] = {wire::Waveform::parabolic, wire::Waveform::sinusoidal,
                                                   wire::Waveform::trapezoidal, wire::Waveform::sawtooth,
                                                   wire::Waveform::reversed_sawtooth};
    const double rate_Hz = below(4) == 0 ? 200'000 : 1'000 + below(29'001);
    return {.waveform = waveforms[below(std::size(waveforms))],
            .peak_rate_Hz = rate_Hz,
            .period_s = 0.2,
            .cycles = 2};
  }

  /// The cut comes at any moment of the second cycle: the switches have then been left behind.
  void cut(const StepRateTrial& trial, Input input) {
    wire::Arm arm = wire::Arm::example();
    arm.rest_us = 1'000;
    ASSERT_TRUE(session_.ask(wire::ClearProgram{}) && session_.ask(segment_of(trial)) && session_.ask(arm));
    const uint64_t triggers = session_.triggers;
    ASSERT_TRUE(session_.start());
    ASSERT_TRUE(session_.run_until([&] { return session_.triggers > triggers; }, 1000 * ms));
    const uint64_t cut_ns = session_.now_ns() + 190 * ms + below(195'000'000);
    drive(session_.controller(), input, true, cut_ns);
    steps_ns_.clear();
    session_.run_to(cut_ns + 20 * ms);
    ASSERT_EQ(session_.fault, fault_of(input)) << wire::fault_name(session_.fault);
    count(cut_ns);
    drive(session_.controller(), input, false, session_.now_ns());
  }

  void count(uint64_t cut_ns) {
    const auto first_over = std::ranges::upper_bound(steps_ns_, cut_ns);
    const auto over = static_cast<int>(steps_ns_.end() - first_over);
    ++figures_.cuts;
    figures_.steps_over += static_cast<uint64_t>(over);
    figures_.most_steps_over = std::max(figures_.most_steps_over, over);
    if (over > 0) figures_.worst_ns = std::max(figures_.worst_ns, steps_ns_.back() - cut_ns);
  }

  void recover() {
    if (testing::Test::HasFailure()) return;
    session_.run_for(5 * ms);
    wire::Home home{};
    home.lease_id = EmulatedSession::lease;
    session_.fault = wire::Fault::none;
    ASSERT_TRUE(session_.ask(wire::ClearFault{}));
    ASSERT_TRUE(session_.ask(home));
    ASSERT_TRUE(session_.run_until([&] { return session_.state == wire::State::homed; }, 60'000 * ms));
  }

  std::mt19937 random_;
  EmulatedSession session_;
  std::vector<uint64_t> steps_ns_;
  uint64_t rose_ns_ = 0;
  CutFigures figures_;
};

}  // namespace

CutFigures cut_at_random(int trials, uint32_t seed) { return RandomCuts(seed).run(trials); }

}  // namespace diastole::step_path_test
