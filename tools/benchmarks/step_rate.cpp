#include "tools/benchmarks/step_rate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <ostream>

#include "firmware/core/profiles/profile.hpp"
#include "protocol/wire/crc32.hpp"
#include "protocol/wire/wire_text.hpp"
#include "tools/benchmarks/emulated_session.hpp"

namespace diastole {
namespace {

uint64_t nanoseconds(double time_s) { return static_cast<uint64_t>(time_s * 1e9); }

const InterruptStatistics* interrupt(const BoardStatistics& board, uint32_t irq) {
  const auto found = std::ranges::find(board.interrupts, irq, &InterruptStatistics::irq);
  return found == board.interrupts.end() ? nullptr : &*found;
}

constexpr uint16_t points = 96;

/// A sine as a host may upload it: the rise from each of 96 points to the next.
const wire::WaveformPoints& uploaded_sine() {
  static const wire::WaveformPoints lot = [] {
    wire::WaveformPoints sine{};
    sine.count = points;
    for (uint32_t i = 0; i < points / 2; ++i) {
      sine.rise[i] =
          static_cast<int16_t>(std::lround(32'000 * std::sin((i + 0.5) * 2 * std::numbers::pi / points)));
      sine.rise[points - 1 - i] = static_cast<int16_t>(-sine.rise[i]);
    }
    return sine;
  }();
  return lot;
}

bool upload_sine(EmulatedSession& session) {
  wire::Crc32 crc;
  for (uint32_t i = 0; i < points; ++i) {
    crc.add(static_cast<uint8_t>(uploaded_sine().rise[i] & 0xff));
    crc.add(static_cast<uint8_t>(uploaded_sine().rise[i] >> 8 & 0xff));
  }
  return session.ask(wire::UploadWaveform{0, 0, points, crc.value()}) && session.ask(uploaded_sine());
}

/// Largest speed of a waveform, stroke and period being 1.
double peak_speed(wire::Waveform waveform) {
  if (waveform == wire::Waveform::uploaded) return std::numbers::pi * 1.001;
  return firmware::find_profile(waveform)->peak_speed_millionths * 1e-6;
}

/// Adds what happens in the measured part of one cycle that begins now.
void measure_cycle(EmulatedSession& session, const StepRateTrial& trial, StepRateFigures& figures,
                   BoardStatistics& spent) {
  const uint64_t begin_ns = session.now_ns();
  session.run_to(begin_ns + nanoseconds(trial.from * trial.period_s));
  const BoardStatistics before = session.statistics();
  const uint64_t steps_before = session.steps;
  session.run_to(begin_ns + nanoseconds(trial.to * trial.period_s));
  const BoardStatistics after = session.statistics();
  figures.steps += session.steps - steps_before;
  spent.instructions += after.instructions - before.instructions;
  spent.cycles += after.cycles - before.cycles;
  spent.asleep_cycles += after.asleep_cycles - before.asleep_cycles;
}

std::string problem_of(EmulatedSession& session, const StepRateTrial& trial, uint64_t steps_before) {
  if (session.fault != wire::Fault::none) return std::string(wire::fault_name(session.fault));
  if (!session.ended) return "the run did not end";
  const uint64_t expected = 2 * uint64_t{segment_of(trial).stroke_nL} * trial.cycles;
  if (session.steps - steps_before != expected)
    return fmt::format("{} steps instead of {}", session.steps - steps_before, expected);
  const BoardStatistics board = session.statistics();
  if (!board.notes.empty()) return board.notes.begin()->first;
  if (board.missed_deadlines != 0) return fmt::format("{} missed deadlines", board.missed_deadlines);
  return board.serial_overruns == 0 ? "" : fmt::format("{} serial overruns", board.serial_overruns);
}

}  // namespace

std::ostream& operator<<(std::ostream& out, const StepRateTrial& trial) {
  return out << wire::waveform_name(trial.waveform) << " at " << trial.peak_rate_Hz << " steps/s";
}

uint64_t StepRateFigures::worst_instructions(uint32_t irq) const {
  const InterruptStatistics* found = interrupt(board, irq);
  return found == nullptr ? 0 : found->worst_instructions;
}

uint64_t StepRateFigures::worst_latency_cycles(uint32_t irq) const {
  const InterruptStatistics* found = interrupt(board, irq);
  return found == nullptr ? 0 : found->worst_latency_cycles;
}

wire::Configure fine_stepping() {
  wire::Configure configure = wire::Configure::example();
  configure.microstep_pL = 1'000;
  configure.travel_uL = 1'000;
  configure.flow_uL_per_s = 1'000;
  configure.acceleration_uL_per_s2 = 20'000;
  configure.step_rate_Hz = 400'000;
  configure.inertance_kg_per_m4 = 0;
  configure.homing_flow_uL_per_s = 5;
  return configure;
}

wire::AddSegment segment_of(const StepRateTrial& trial) {
  wire::AddSegment segment{};
  segment.waveform = trial.waveform;
  segment.cycles = trial.cycles;
  segment.stroke_nL =
      static_cast<uint32_t>(std::floor(trial.peak_rate_Hz * trial.period_s / peak_speed(trial.waveform)));
  segment.period_us = static_cast<uint32_t>(trial.period_s * 1e6);
  return segment;
}

StepRateFigures measure(const std::string& image, const StepRateTrial& trial) {
  StepRateFigures figures;
  EmulatedSession session(image, trial.timing);
  if (!session.prepare(fine_stepping())) {
    figures.problem = "not homed";
    return figures;
  }
  const uint64_t steps_before = session.steps;
  const bool ready = trial.waveform != wire::Waveform::uploaded || upload_sine(session);
  if (!ready || !session.ask(segment_of(trial)) || !session.ask(wire::Arm::example()) || !session.start()) {
    figures.problem = "refused";
    if (session.refused)
      figures.problem = fmt::format("refused: {} {}", wire::refusal_name(session.refused->refusal),
                                    wire::limit_name(session.refused->limit));
    return figures;
  }
  session.flood = trial.flood;
  BoardStatistics spent;
  for (uint32_t cycle = 0; cycle < trial.cycles; ++cycle) {
    const uint64_t triggers = session.triggers;
    if (!session.run_until([&] { return session.triggers > triggers; }, nanoseconds(2 + 2 * trial.period_s)))
      break;
    measure_cycle(session, trial, figures, spent);
  }
  session.run_until([&] { return session.ended || session.fault != wire::Fault::none; },
                    nanoseconds(2 + 2 * trial.period_s));
  session.run_for(20'000'000);
  figures.problem = problem_of(session, trial, steps_before);
  figures.board = session.statistics();
  const auto steps = static_cast<double>(std::max<uint64_t>(figures.steps, 1));
  const auto cycles = static_cast<double>(std::max<uint64_t>(spent.cycles, 1));
  figures.instructions = static_cast<double>(spent.instructions) / steps;
  figures.cycles = static_cast<double>(spent.cycles - spent.asleep_cycles) / steps;
  figures.headroom = static_cast<double>(spent.asleep_cycles) / cycles;
  figures.rate_Hz = steps * figures.board.core_Hz / cycles;
  return figures;
}

StepRateFigures measure_interrupts(const std::string& image) {
  StepRateFigures figures;
  EmulatedSession session(image);
  if (!session.prepare(fine_stepping()) || !session.ask(segment_of({.period_s = 0.5, .cycles = 4})) ||
      !session.ask(wire::Arm::example()) || !session.start()) {
    figures.problem = "not started";
    return figures;
  }
  session.flood = true;
  session.run_until([&] { return session.triggers == 4; }, 10'000'000'000);
  session.controller().press_estop(session.now_ns() + 60'000'000);
  session.run_for(100'000'000);
  if (session.fault != wire::Fault::estop) figures.problem = "the e-stop was not told";
  figures.board = session.statistics();
  return figures;
}

}  // namespace diastole
