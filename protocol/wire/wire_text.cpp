#include "protocol/wire/wire_text.hpp"

#include <cstddef>

namespace diastole::wire {

namespace {

struct Words {
  std::string_view name, explanation, remedy;
};

constexpr Words kFaults[] = {
#define DIASTOLE_FAULT(number, name, explanation, remedy) {#name, explanation, remedy},
#include "protocol/wire/fault_list.inc"
};
constexpr Words kRefusals[] = {
#define DIASTOLE_REFUSAL(number, name, explanation) {#name, explanation, {}},
#include "protocol/wire/refusal_list.inc"
};
constexpr Words kLimits[] = {
#define DIASTOLE_LIMIT(number, name, unit) {#name, unit, {}},
#include "protocol/wire/limit_list.inc"
};
constexpr Words kStates[] = {
#define DIASTOLE_STATE(number, name) {#name, {}, {}},
#include "protocol/wire/state_list.inc"
};
constexpr Words kWaveforms[] = {
#define DIASTOLE_WAVEFORM(number, name) {#name, {}, {}},
#include "protocol/wire/waveform_list.inc"
};
constexpr Words kRunEnds[] = {
#define DIASTOLE_RUN_END(number, name) {#name, {}, {}},
#include "protocol/wire/run_end_list.inc"
};

constexpr Words kUpdateOutcomes[] = {
#define DIASTOLE_UPDATE_OUTCOME(number, name, explanation, remedy) {#name, explanation, remedy},
#include "protocol/wire/update_outcome_list.inc"
};
constexpr Words kNoted[] = {
#define DIASTOLE_BLACK_BOX(number, name) {#name, {}, {}},
#include "protocol/wire/black_box_list.inc"
};
constexpr Words kCrashRegisterNames[] = {
#define DIASTOLE_CRASH_REGISTER(number, name) {#name, {}, {}},
#include "protocol/wire/crash_register_list.inc"
};

template <class Enum, std::size_t N>
const Words& words_of(const Words (&table)[N], Enum number) {
  static constexpr Words kUnknown{"unknown", "A number that this program does not know.",
                                  "Update the host programs."};
  const auto index = static_cast<std::size_t>(number);
  return index < N ? table[index] : kUnknown;
}

}  // namespace

std::string_view fault_name(Fault fault) { return words_of(kFaults, fault).name; }
std::string_view fault_explanation(Fault fault) { return words_of(kFaults, fault).explanation; }
std::string_view fault_remedy(Fault fault) { return words_of(kFaults, fault).remedy; }
std::string_view refusal_name(Refusal refusal) { return words_of(kRefusals, refusal).name; }
std::string_view refusal_explanation(Refusal refusal) { return words_of(kRefusals, refusal).explanation; }
std::string_view limit_name(Limit limit) { return words_of(kLimits, limit).name; }
std::string_view state_name(State state) { return words_of(kStates, state).name; }
std::string_view waveform_name(Waveform waveform) { return words_of(kWaveforms, waveform).name; }
std::string_view noted_name(Noted kind) { return words_of(kNoted, kind).name; }
std::string_view crash_register_name(CrashRegister which) {
  return words_of(kCrashRegisterNames, which).name;
}
std::string_view run_end_name(RunEnd reason) { return words_of(kRunEnds, reason).name; }
std::string_view update_outcome_explanation(UpdateOutcome outcome) {
  return words_of(kUpdateOutcomes, outcome).explanation;
}
std::string_view update_outcome_remedy(UpdateOutcome outcome) {
  return words_of(kUpdateOutcomes, outcome).remedy;
}

}  // namespace diastole::wire
