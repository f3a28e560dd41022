#pragma once
// The controller's states, the waveforms it may be asked for and the ways a run ends, as numbered on the
// wire.
//
//   unhomed ──Home──▶ homing ──switch found──▶ homed ──Arm──▶ armed ──Start──▶ running
//      ▲                                         ▲ ▲             │                │ Stop…, end of program,
//      │ ClearFault (position lost)              │ └ClearProgram─┘                ▼ lease lost
//   faulted ◀── e-stop, limit, underrun, …       └─────────── at rest ─────── stopping
//      └── ClearFault (position kept: lease_lost) ──▶ homed
//
//   unhomed, homed ──Jog──▶ jogging ──at rest──▶ as before        homing ──StopNow──▶ unhomed
//   homed, armed ──settings written──▶ unhomed

#include <cstdint>

#include "protocol/wire/last_of.hpp"

namespace diastole::wire {

#define DIASTOLE_STATE(number, name) name = number,
enum class State : std::uint8_t {
#include "protocol/wire/state_list.inc"
};
#define DIASTOLE_STATE(number, name) State::name,
inline constexpr State kLastState = last_of({
#include "protocol/wire/state_list.inc"
});

#define DIASTOLE_WAVEFORM(number, name) name = number,
enum class Waveform : std::uint8_t {
#include "protocol/wire/waveform_list.inc"
};
#define DIASTOLE_WAVEFORM(number, name) Waveform::name,
inline constexpr Waveform kLastWaveform = last_of({
#include "protocol/wire/waveform_list.inc"
});

#define DIASTOLE_RUN_END(number, name) name = number,
enum class RunEnd : std::uint8_t {
#include "protocol/wire/run_end_list.inc"
};
#define DIASTOLE_RUN_END(number, name) RunEnd::name,
inline constexpr RunEnd kLastRunEnd = last_of({
#include "protocol/wire/run_end_list.inc"
});

enum class ResetCause : std::uint8_t { unknown = 0, power_on = 1, reset_pin = 2, software = 3, watchdog = 4 };
inline constexpr ResetCause kLastResetCause = ResetCause::watchdog;

}  // namespace diastole::wire
