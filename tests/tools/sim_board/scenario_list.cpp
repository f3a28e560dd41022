#include "tests/firmware/uploaded_waveform.hpp"
#include "tests/firmware/uploads.hpp"
#include "tests/tools/sim_board/scenario.hpp"

namespace diastole::sim_board_test {
namespace {

using wire::Waveform;

wire::AddSegment segment(Waveform waveform, uint32_t cycles, uint32_t stroke_nL, uint32_t period_us,
                         uint32_t offset_nL = 0) {
  return {0, waveform, cycles, stroke_nL, offset_nL, period_us};
}

wire::AddSegment paper() { return segment(Waveform::parabolic, 2, 40'000'000, 1'200'000); }

void home(MiniatureHost& host) {
  wire::Home request{};
  request.lease_id = MiniatureHost::lease;
  (void)host.ask(request);
  host.run_until([&] { return host.state == wire::State::homed; }, 60'000'000'000);
}

void upload_heart(MiniatureHost& host) {
  (void)host.ask(firmware::upload_of(0, firmware::kHeartRises));
  (void)host.ask(firmware::lot_of(firmware::kHeartRises, 0));
}

/// There, and half the way back.
void jog(MiniatureHost& host) {
  for (const int64_t distance_nL : {6'000'000, -3'000'000}) {
    wire::Jog request{};
    request.lease_id = MiniatureHost::lease;
    request.distance_nL = distance_nL;
    request.flow_uL_per_s = 5'000;
    (void)host.ask(request);
    host.run_until([&] { return host.state == wire::State::homed; }, 10'000'000'000);
    host.run_for(100'000'000);
  }
}

}  // namespace

const std::vector<Scenario>& scenarios() {
  static const std::vector<Scenario> list{
  // Undisturbed: equal to the last edge.
#define DIASTOLE_PROFILE(number, profile) \
  {.name = #profile, .program = {segment(Waveform::profile, 2, 8'000'000, 800'000)}},
#include "protocol/wire/waveform_list.inc"
      {.name = "the_papers_cycle", .program = {paper()}},
      {.name = "uploaded",
       .program = {segment(Waveform::uploaded, 2, 20'000'000, 1'200'000)},
       .before = upload_heart},
      {.name = "offset", .program = {segment(Waveform::parabolic, 1, 10'000'000, 1'000'000, 5'000'000)}},
      {.name = "segments_in_sequence",
       .program = {segment(Waveform::parabolic, 2, 40'000'000, 1'200'000),
                   segment(Waveform::sinusoidal, 2, 16'000'000, 800'000, 4'000'000),
                   segment(Waveform::trapezoidal, 1, 8'000'000, 800'000),
                   segment(Waveform::hold, 2, 2'000'000, 300'000, 1'000'000),
                   segment(Waveform::sawtooth, 1, 8'000'000, 800'000)}},
      {.name = "every_second_cycle_gated",
       .program = {segment(Waveform::parabolic, 5, 10'000'000, 600'000)},
       .gate_every = 2},
      {.name = "delayed_triggers",
       .program = {segment(Waveform::parabolic, 3, 10'000'000, 600'000),
                   segment(Waveform::hold, 2, 2'000'000, 300'000, 1'000'000)},
       .gate_every = 2,
       .trigger_delay_us = 250'013},
      {.name = "estop_before_a_delayed_trigger",
       .program = {paper()},
       .trigger_delay_us = 500'000,
       .act = Act::estop,
       .act_after_ms = 300},
      {.name = "paper_rate_30kHz", .program = {segment(Waveform::parabolic, 1, 70'000'000, 1'200'000)}},
      {.name = "homing", .program = {paper()}, .motion = home, .to_a_switch = true},
      {.name = "jog_there_and_back", .program = {paper()}, .motion = jog},
      {.name = "stop_at_cycle_end", .program = {paper()}, .act = Act::stop_at_cycle_end, .act_after_ms = 500},
      // Stopped or cut off in their first or second cycle (each 1.2 s).
      {.name = "stop_now_on_the_rise", .program = {paper()}, .act = Act::stop_now, .act_after_ms = 1'500},
      {.name = "stop_now_on_the_fall", .program = {paper()}, .act = Act::stop_now, .act_after_ms = 2'100},
      {.name = "halt", .program = {paper()}, .act = Act::halt, .act_after_ms = 1'530},
      {.name = "estop_on_the_rise", .program = {paper()}, .act = Act::estop, .act_after_ms = 1'490},
      {.name = "estop_on_the_fall", .program = {paper()}, .act = Act::estop, .act_after_ms = 2'033},
      {.name = "estop_in_the_r_wave", .program = {paper()}, .act = Act::estop, .act_after_ms = 1'205},
      {.name = "estop_on_the_ramp",
       .program = {segment(Waveform::parabolic, 2, 10'000'000, 1'000'000, 10'000'000)},
       .act = Act::estop,
       .act_after_ms = 333},
      {.name = "far_limit", .program = {paper()}, .act = Act::far_limit, .act_after_ms = 1'611},
      {.name = "lease_lost", .program = {paper()}, .act = Act::silence, .act_after_ms = 1'400},
  };
  return list;
}

}  // namespace diastole::sim_board_test
