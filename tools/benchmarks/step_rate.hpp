#pragma once
// What a step costs the controller, measured on the emulated board while it makes steps at a given rate.

#include <cstdint>
#include <iosfwd>
#include <string>

#include "protocol/wire/messages.hpp"
#include "tools/sim_board/sim_board.hpp"

namespace diastole {

struct StepRateTrial {
  wire::Waveform waveform = wire::Waveform::trapezoidal;
  double peak_rate_Hz = 200'000;
  double period_s = 2.0;
  uint32_t cycles = 1;
  bool flood = false;                                                ///< the serial line is busy all the time
  board_model::FlashTiming timing = board_model::FlashTiming::hits;  ///< of the flash's wait states
  /// The part of each cycle that is measured, in phases: around the peak rate.
  double from = 0.05, to = 0.2;
};

std::ostream& operator<<(std::ostream& out, const StepRateTrial& trial);

struct StepRateFigures {
  std::string problem;      ///< empty: every step was made, no fault, no missed deadline
  double rate_Hz = 0;       ///< steps made over the measured part
  uint64_t steps = 0;       ///< in the measured part
  double instructions = 0;  ///< of a step, all in: planning, queue, interrupt, telemetry, link
  double cycles = 0;        ///< the same with the waits for the flash
  double headroom = 0;      ///< part of the time that the core slept
  BoardStatistics board;    ///< of the whole session

  /// Of interrupt number `irq`: instructions at worst, and cycles from its request to its first instruction.
  [[nodiscard]] uint64_t worst_instructions(uint32_t irq) const;
  [[nodiscard]] uint64_t worst_latency_cycles(uint32_t irq) const;
};

/// Geometry and limits for such a trial: microsteps of 1 nL, up to 400,000 a second.
wire::Configure fine_stepping();

/// The stroke whose peak rate is the trial's.
wire::AddSegment segment_of(const StepRateTrial& trial);

/// Throws InputError when the image cannot be read.
StepRateFigures measure(const std::string& image, const StepRateTrial& trial);

/// Interrupts at their worst: homing, cycles at 200,000 steps/s with TTL, R-wave and position stream, the line
/// flooded, and an e-stop on the rise of the fourth. Only `problem` and `board` are filled in.
StepRateFigures measure_interrupts(const std::string& image);

}  // namespace diastole
