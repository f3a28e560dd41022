#include "tools/sim_rig/faults/fault_kind.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole::sim_rig {
namespace {

constexpr std::array kinds{
#define DIASTOLE_RIG_FAULT(function, name, unit, least, most, usual, looks_like) \
  FaultKind{name, unit, least, most, usual, looks_like, &faults::function},
#include "tools/sim_rig/faults/fault_list.inc"
#undef DIASTOLE_RIG_FAULT
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

std::span<const FaultKind> fault_kinds() { return kinds; }

const FaultKind& fault_named(std::string_view name) {
  const auto* found = std::ranges::find(kinds, name, &FaultKind::name);
  if (found != kinds.end()) return *found;
  std::vector<std::string> known;
  for (const FaultKind& kind : kinds)
    known.emplace_back(kind.name);
  throw InputError({"", "fault", fmt::format("\"{}\" is not a fault", name),
                    did_you_mean(name, known) + "`sim_rig faults` lists those that there are."});
}

std::string list_of_faults() {
  std::string text;
  for (const FaultKind& kind : kinds) {
    const std::string value = kind.unit.empty() ? "" : fmt::format("{:g} {}", kind.usual, kind.unit);
    text += fmt::format("{:<18} {:<16} {}\n", kind.name, value, kind.looks_like);
  }
  return text;
}

}  // namespace diastole::sim_rig
