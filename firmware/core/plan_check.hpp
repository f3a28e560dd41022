#pragma once
// Every limit is checked before anything moves. For a segment of stroke S and period T with a profile whose
// normalised peaks are v and a (profile.hpp):
//
//   flow = v S/T     acceleration = a S/T²     step rate = flow / microstep
//   pressure = inertance · acceleration + losses(flow) + cavity        stopping time = flow / allowed acceleration
//
// all rounded up; losses as message Configure has them. Flow and acceleration have their peaks at the same moment in a
// parabola and in a flank's end, and at different ones elsewhere, where their sum is more than ever comes. A delayed trigger must be over, TTL and R-wave, one period after the cycle's beginning: then it
// belongs to its cycle, and a run ends behind its last trigger. A hold has no peaks and may have any stroke. The ramps between segments are planned within the limits and need no check.

#include <cstdint>

#include "firmware/core/program.hpp"
#include "protocol/wire/faults.hpp"
#include "protocol/wire/machine_settings.hpp"
#include "protocol/wire/result.hpp"

namespace diastole::firmware {

struct SegmentPeaks {
  std::uint64_t flow_uL_per_s = 0;
  std::uint64_t acceleration_uL_per_s2 = 0;
  std::uint64_t step_rate_Hz = 0;
  std::uint64_t pressure_Pa = 0;
  std::uint64_t stopping_us = 0;
  Steps cycle_steps;
};

/// Why a program is refused; asked and allowed are in the limit's unit (limit_list.inc).
struct PlanRefusal {
  wire::Refusal refusal = wire::Refusal::none;
  wire::Limit limit = wire::Limit::none;
  std::uint16_t segment = 0;
  std::int64_t asked = 0;
  std::int64_t allowed = 0;
};

/// Whether geometry and limits are those of this machine: the same volume a microstep, to 20 parts in a million,
/// and neither more travel nor more steps a second than it has.
PlanRefusal check_configuration(const wire::Configure& configure, const wire::MachineSettings& machine);

/// The window in which every reversal of the program takes up the play (backlash_compensation.hpp), in µs: at most an
/// eighth of any period and a quarter of a second, and with room between the steps of the profile; or the limit that it
/// exceeds.
wire::Result<std::uint32_t, PlanRefusal> check_compensation(const Program& program, const Settings& settings,
                                                            std::uint32_t backlash_steps);

/// Peaks of one segment. Precondition: the firmware has its waveform.
SegmentPeaks segment_peaks(const Segment& segment, const Settings& settings);

/// A delayed trigger is ordered when the cycle's first step has been made.
inline constexpr std::uint32_t kLeastTriggerDelay_us = 100;

/// From the beginning of a cycle to its first step, rounded up. Precondition: the stroke is a microstep at least.
std::uint64_t first_step_us(const Segment& segment, const Settings& settings);

/// The longest stopping time of the program's segments and ramps, or the first limit that it exceeds.
wire::Result<Ticks, PlanRefusal> check_program(const Program& program, const Settings& settings);

}  // namespace diastole::firmware
