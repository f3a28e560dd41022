#include "tests/tools/sim_board/scenario_rig.hpp"

#include <map>
#include <vector>

#include "firmware/boards/recording/recorded_controller.hpp"
#include "firmware/core/homing.hpp"
#include "tools/sim_board/emulated_controller.hpp"

namespace diastole::sim_board_test {
namespace {

firmware::Ticks ticks_at(uint64_t time_ns) {
  return {static_cast<int64_t>(time_ns / 1000 * 84 + time_ns % 1000 * 84 / 1000)};
}

class RecordedRig final : public ScenarioRig, public sim_controller::SimulatedController {
 public:
  sim_controller::SimulatedController& controller() override { return *this; }
  void set_estop(uint64_t time_ns, bool pressed) override { switches_.emplace(time_ns, Move{true, pressed}); }
  void set_far_limit(uint64_t time_ns, bool closed) override {
    switches_.emplace(time_ns, Move{false, closed});
  }
  [[nodiscard]] int64_t position_microsteps() const override { return board_.mechanical_microsteps(); }

  [[nodiscard]] Places places() const override {
    return {board_.mechanical_microsteps(), 1 + int64_t{firmware::kHomeClearance_steps}};
  }
  void receive(std::span<const uint8_t> bytes) override { board_.feed(bytes); }
  Output advance_to(uint64_t until_ns) override {
    for (; !switches_.empty() && switches_.begin()->first <= until_ns; switches_.erase(switches_.begin())) {
      const auto [time_ns, move] = *switches_.begin();
      board_.advance_to(ticks_at(time_ns));
      move.estop ? board_.set_estop(move.on) : board_.set_far_limit(move.on);
    }
    board_.advance_to(ticks_at(until_ns));
    sent_ = board_.take_output();
    edges_.clear();
    for (const firmware::Edge& edge : board_.take_edges())
      edges_.push_back(
          {static_cast<uint64_t>(firmware::nanoseconds(edge.tick)), pin_of(edge.signal), edge.value});
    return {sent_, edges_};
  }

 private:
  struct Move {
    bool estop;
    bool on;
  };
  /// Both lists of pins have the order of the pin trace's contract.
  static sim_controller::Pin pin_of(firmware::Signal signal) {
    return static_cast<sim_controller::Pin>(signal);
  }

  firmware::RecordedController board_;
  std::multimap<uint64_t, Move> switches_;
  std::vector<uint8_t> sent_;
  std::vector<sim_controller::PinEdge> edges_;
};

class EmulatedRig final : public ScenarioRig {
 public:
  explicit EmulatedRig(const std::string& image) : controller_(std::vector{read_image(image)}) {}
  sim_controller::SimulatedController& controller() override { return controller_; }
  void set_estop(uint64_t time_ns, bool pressed) override { controller_.press_estop(time_ns, pressed); }
  void set_far_limit(uint64_t time_ns, bool closed) override { controller_.close_far_limit(time_ns, closed); }
  [[nodiscard]] int64_t position_microsteps() const override { return controller_.position_microsteps(); }

 private:
  EmulatedController controller_;
};

}  // namespace

std::unique_ptr<ScenarioRig> recorded_rig() { return std::make_unique<RecordedRig>(); }

std::unique_ptr<ScenarioRig> emulated_rig(const std::string& image) {
  return std::make_unique<EmulatedRig>(image);
}

}  // namespace diastole::sim_board_test
