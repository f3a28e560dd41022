// The whole controller on the recording board, with any bytes, frames and requests on its line and switches that
// move at any time (other: bit 0 e-stop, bit 1 far limit, bit 2 the host's heartbeats cease). Whatever comes: it
// answers in messages that decode, makes a step only while the motor has power, and no two closer than the timer
// allows.

#include "tests/firmware/bench.hpp"
#include "tests/fuzz/script.hpp"

namespace {

using namespace diastole;
using firmware::Bench;
using firmware::Edge;
using firmware::microseconds;
using firmware::Signal;
using fuzz::must;

void check_pins(const std::vector<Edge>& edges) {
  bool powered = false;
  firmware::Ticks last{-firmware::kTicksPerSecond};
  for (const Edge& edge : edges) {
    if (edge.signal == Signal::ENABLE) powered = edge.value != 0;
    if (edge.signal != Signal::STEP || edge.value == 0) continue;
    must(powered);
    must(edge.tick - last >= firmware::kStepPulse);
    last = edge.tick;
  }
}

void play(Bench& bench, fuzz::Script& script) {
  std::array<std::uint8_t, wire::kMaxEncodedBytes> memory{};
  switch (script.step()) {
    case fuzz::Step::raw:
      return bench.rig.feed(script.sized());
    case fuzz::Step::message: {
      const auto type = static_cast<wire::MessageType>(script.byte());
      if (!bench.link.send(type, script.sized())) bench.run_for(microseconds(4'000));
      return;
    }
    case fuzz::Step::frame:
      return bench.rig.feed(script.frame(bench.link.session(), memory));
    case fuzz::Step::time:
      return bench.run_for(microseconds(4'000 * std::int64_t{script.byte()}));
    case fuzz::Step::other: {
      const std::uint8_t what = script.byte();
      bench.rig.set_estop((what & 1U) != 0);
      bench.rig.set_far_limit((what & 2U) != 0);
      bench.heartbeats = (what & 4U) == 0;
      return;
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  firmware::RecordedController::Options options;
  options.board.mechanics.start_steps = 10;
  options.turn = microseconds(1'000);
  Bench bench(options);
  bench.connect();
  fuzz::Script script({data, size});
  const firmware::Ticks end = bench.rig.now() + firmware::Ticks{5 * firmware::kTicksPerSecond};
  while (!script.done() && bench.rig.now() < end) {
    play(bench, script);
    bench.run_for(microseconds(1'000));
  }
  bench.run_for(microseconds(50'000));
  check_pins(bench.rig.take_edges());
  must(bench.heard.undecodable == 0);
  return 0;
}
