// Faults of the pressure instrument.

#include <cmath>

#include "tools/sim_rig/faults/fault_kind.hpp"

namespace diastole::sim_rig::faults {
namespace {

sim_daq::FaultWindow window(bool on) { return on ? sim_daq::FaultWindow::always() : sim_daq::FaultWindow{}; }

}  // namespace

void daq_stall(RigInTrouble& rig, std::optional<double> value) {
  rig.instrument.faults().stall = window(value.has_value());
}

void daq_drop(RigInTrouble& rig, std::optional<double> value) {
  rig.instrument.faults().drop = window(value.has_value());
}

void daq_delay(RigInTrouble& rig, std::optional<double> value) {
  rig.instrument.faults().delay = window(value.has_value());
  rig.instrument.faults().delay_ns = static_cast<uint64_t>(std::llround(value.value_or(0) * 1e9));
}

void daq_error(RigInTrouble& rig, std::optional<double> value) {
  rig.instrument.faults().refuse = value.has_value();
}

void daq_short(RigInTrouble& rig, std::optional<double> value) {
  rig.instrument.faults().cut_short = value.has_value();
}

void daq_stuck(RigInTrouble& rig, std::optional<double> value) {
  rig.instrument.faults().stuck = value.has_value();
}

void daq_clock_jump(RigInTrouble& rig, std::optional<double> value) {
  rig.instrument.faults().timer_ahead_s = value.value_or(0);
}

}  // namespace diastole::sim_rig::faults
