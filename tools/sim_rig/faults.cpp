#include "tools/sim_rig/faults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole::sim_rig {
namespace {

using sim_controller::Switch;
using Value = std::optional<double>;

sim_daq::FaultWindow window(Value value) {
  return value ? sim_daq::FaultWindow::always() : sim_daq::FaultWindow{};
}

/// A new fault is an entry here.
constexpr std::array known_faults{
    // Of the controller's inputs and supply.
    FaultKind{.name = "estop",
              .looks_like =
                  "emergency stop pressed: fault 1, the motor is cut off within a step, the run ends faulted",
              .set = [](FaultTarget& in,
                        Value value) { in.rig.controller().hold_switch(Switch::estop, value.has_value()); }},
    FaultKind{
        .name = "far-limit",
        .looks_like = "far limit switch closed: fault 2 while inflating, no start",
        .set = [](FaultTarget& in,
                  Value value) { in.rig.controller().hold_switch(Switch::far_limit, value.has_value()); }},
    FaultKind{.name = "home-limit",
              .looks_like = "home switch closed: fault 3 outside of homing, the position is lost",
              .set = [](FaultTarget& in,
                        Value value) { in.rig.controller().hold_switch(Switch::home, value.has_value()); }},
    FaultKind{
        .name = "power-cut",
        .looks_like =
            "controller without supply: all pins low, the line silent; off: it boots, unhomed, new boot id",
        .set = [](FaultTarget& in, Value value) { in.rig.controller().set_power(!value); }},
    // Of the cables to the host and to the scanner.
    FaultKind{.name = "serial-hangup",
              .looks_like = "serial cable (USB) pulled out: link_lost at once, the pump stops within its "
                            "lease; off: plugged in",
              .set = [](FaultTarget& in,
                        Value value) { value ? in.cables.line.hang_up() : in.cables.line.plug_in(); }},
    FaultKind{.name = "serial-silence",
              .looks_like = "serial line hangs, nothing passes either way: link_lost after 1 s, the pump "
                            "stops within its lease",
              .set = [](FaultTarget& in, Value value) { in.cables.to_host = in.cables.from_host = !value; }},
    FaultKind{.name = "serial-deaf",
              .looks_like = "what the host sends is lost, the controller is heard: fault 5 (lease_lost)",
              .set = [](FaultTarget& in, Value value) { in.cables.from_host = !value; }},
    FaultKind{.name = "gate-lost",
              .looks_like = "gating cable cut: TTL and R-wave do not reach the scanner (pin trace); the "
                            "controller counts them",
              .set = [](FaultTarget& in, Value value) { in.cables.to_scanner = !value; }},
    // Of the pressure instrument.
    FaultKind{.name = "daq-stall",
              .looks_like = "instrument answers nothing: time-outs, a gap as long as it lasts",
              .set = [](FaultTarget& in, Value value) { in.instrument.faults().stall = window(value); }},
    FaultKind{.name = "daq-drop",
              .looks_like = "instrument closes its connections and takes none: a gap as long as it lasts",
              .set = [](FaultTarget& in, Value value) { in.instrument.faults().drop = window(value); }},
    FaultKind{"daq-delay", "s", 0, 1000, 0.05,
              "instrument's answers come late: time-outs or slow samples, never an old answer for a new one",
              [](FaultTarget& in, Value value) {
                in.instrument.faults().delay = window(value);
                in.instrument.faults().delay_ns =
                    static_cast<uint64_t>(std::llround(value.value_or(0) * 1e9));
              }},
    FaultKind{.name = "daq-error",
              .looks_like = "instrument answers with Modbus exception 11: a gap as long as it lasts",
              .set = [](FaultTarget& in, Value value) { in.instrument.faults().refuse = value.has_value(); }},
    FaultKind{
        .name = "daq-short",
        .looks_like = "answers break off in the middle (short reads): a gap as long as it lasts",
        .set = [](FaultTarget& in, Value value) { in.instrument.faults().cut_short = value.has_value(); }},
    FaultKind{.name = "daq-stuck",
              .looks_like = "the reading freezes: one and the same value while the pump goes on",
              .set = [](FaultTarget& in, Value value) { in.instrument.faults().stuck = value.has_value(); }},
    FaultKind{"daq-clock-jump", "s", -50, 50, 0.5,
              "the instrument's timer is ahead: a step in its clock, samples keep their times",
              [](FaultTarget& in, Value value) { in.instrument.faults().timer_ahead_s = value.value_or(0); }},
    // Of transducer, phantom, hose and piston; their physics is in tools/sim_rig/plant.
    FaultKind{
        "sensor-offset", "kPa", -1000, 1000, 0.5, "cavity transducer off by a constant",
        [](FaultTarget& in, Value value) { in.rig.plant().cavity_sensor().falsify(value.value_or(0), 0); }},
    FaultKind{
        "sensor-drift", "kPa/s", -100, 100, 0.05,
        "cavity transducer drifts: the least pressure of each cycle climbs",
        [](FaultTarget& in, Value value) { in.rig.plant().cavity_sensor().falsify(0, value.value_or(0)); }},
    FaultKind{"leak", "mL/s/kPa", 0, 1000, 2,
              "cannula leaks: each cycle's peak lower than the last, suction at the least volume",
              [](FaultTarget& in, Value value) { in.rig.plant().leak(value.value_or(0)); }},
    FaultKind{"air-bubble", "mL", 0, 10000, 100,
              "air in the cavity: lower and softer peaks, most under small pressure",
              [](FaultTarget& in, Value value) { in.rig.plant().admit({.rest_mL = value.value_or(0)}); }},
    FaultKind{"blocked-hose", "share open", 0.01, 1, 0.1,
              "hose kinked at the cannula: the pressure at the pump's end climbs with the flow; the "
              "cavity hardly changes",
              [](FaultTarget& in, Value value) { in.rig.plant().block(value.value_or(1)); }},
    FaultKind{"step-loss", "share lost", 0, 1, 1,
              "motor stalls: the piston follows fewer steps than are counted, the pressure stays behind",
              [](FaultTarget& in, Value value) { in.rig.carriage().slip().lose(value.value_or(0)); }},
    FaultKind{"slipping-coupling", "kPa", 0, 1000, 15,
              "coupling slips above this pressure at the piston: volume is lost with every stroke",
              [](FaultTarget& in, Value value) { in.rig.carriage().slip().slip_above(value); }},
};

}  // namespace

double FaultKind::value(std::optional<double> given) const {
  if (given && unit.empty()) {
    throw InputError({"", "fault " + std::string(name), "takes no value", "Leave the value out."});
  }
  if (given && !(*given >= least && *given <= most)) {
    throw InputError({"", "fault " + std::string(name), fmt::format("cannot have the value {:g}", *given),
                      fmt::format("Give {:g} to {:g} {}.", least, most, unit)});
  }
  return given.value_or(usual);
}

std::span<const FaultKind> fault_kinds() { return known_faults; }

const FaultKind& fault_named(std::string_view name) {
  const auto* found = std::ranges::find(known_faults, name, &FaultKind::name);
  if (found != known_faults.end()) return *found;
  std::vector<std::string> known;
  for (const FaultKind& kind : known_faults)
    known.emplace_back(kind.name);
  throw InputError({"", "fault", fmt::format("\"{}\" is not a fault", name),
                    did_you_mean(name, known) + "`sim_rig faults` lists those that there are."});
}

std::string list_of_faults() {
  std::string text;
  for (const FaultKind& kind : known_faults) {
    const std::string value = kind.unit.empty() ? "" : fmt::format("{:g} {}", kind.usual, kind.unit);
    text += fmt::format("{:<18} {:<16} {}\n", kind.name, value, kind.looks_like);
  }
  return text;
}

}  // namespace diastole::sim_rig
