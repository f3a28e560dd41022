#pragma once
// How late a recorded pressure is, from what the run states about its catheter and its filter.
//
// A catheter of natural frequency f0 and damping ratio zeta (protocol/signal/step_response.hpp) delays what is slow against f0 by
// zeta / (pi f0); a channel that was low-passed states its own delay in its note `delay_s`.

#include <string_view>

#include "protocol/runfile/run.hpp"

namespace diastole::runfile {

struct SignalDelay {
  double catheter_s = 0;  ///< of the cavity's channels; 0 if /rig has no catheter_f0_Hz and catheter_zeta
  double filter_s = 0;
  [[nodiscard]] double total_s() const { return catheter_s + filter_s; }
};

SignalDelay signal_delay(const RecordedRun& run, std::string_view channel);

}  // namespace diastole::runfile
