#include "host/controller/controller_words.hpp"

#include <fmt/format.h>

#include <string_view>

#include "protocol/contract/input_error.hpp"
#include "protocol/wire/message_type.hpp"
#include "protocol/wire/wire_text.hpp"

namespace diastole {
namespace {

struct LimitInWords {
  double scale;  // wire's unit to the user's
  const char* unit;
  const char* remedy;
};

LimitInWords words_for(wire::Limit limit) {
  switch (limit) {
    case wire::Limit::travel:
      return {1e-3, "mL", "Reduce stroke_mL or offset_mL."};
    case wire::Limit::flow:
      return {1e-3, "mL/s", "Reduce stroke_mL or lengthen period_s."};
    case wire::Limit::acceleration:
      return {1e-3, "mL/s2", "Reduce stroke_mL or lengthen period_s; a parabolic waveform needs least."};
    case wire::Limit::step_rate:
      return {1, "microsteps/s", "Reduce stroke_mL, lengthen period_s, or use fewer microsteps."};
    case wire::Limit::pressure:
      return {1e-3, "kPa",
              "Reduce stroke_mL or lengthen period_s: the hose's inertia, friction and end losses and the "
              "cavity together are more than the motor pushes."};
    case wire::Limit::stroke_at_least:
      return {1e-6, "mL", "Enlarge stroke_mL to at least one microstep."};
    case wire::Limit::stopping_time:
      return {1e-6, "s", "Reduce stroke_mL or lengthen period_s, or raise lease_ms in the rig file."};
    case wire::Limit::ttl_width:
      return {1e-3, "ms", "Reduce ttl_width_ms in the rig file or lengthen period_s."};
    case wire::Limit::r_wave_spacing:
      return {1e-6, "s", "Lengthen period_s or raise gate_every."};
    case wire::Limit::microstep:
      return {1, "pL", "Make bore, screw and steps in the rig file agree with the controller's settings."};
    case wire::Limit::home:
      return {1e-3, "mL", "Withdraw less: the home position ends the way."};
    case wire::Limit::take_up:
      return {1e-3, "ms",
              "Reduce stroke_mL or lengthen period_s: at each reversal the motor needs this time to take up "
              "the backlash (diastole settings)."};
    case wire::Limit::trigger_delay:
      return {1e-3, "ms", "Reduce trigger_delay_ms: the TTL and the R-wave end within the period."};
    case wire::Limit::none:
      break;
  }
  return {1, "", "Change the program."};
}

std::string_view message_name(int32_t type) {
  switch (static_cast<wire::MessageType>(type)) {
#define DIASTOLE_MESSAGE(number, name, sender, delivery) \
  case wire::MessageType::name:                          \
    return #name;
#include "protocol/wire/message_list.inc"
  }
  return "unknown";
}

std::string_view cause_in_words(uint8_t cause) {
  constexpr std::array<std::string_view, 5> words{"for an unknown reason", "at power-on", "by the reset pin",
                                                  "by software", "by the watchdog"};
  return words[cause < words.size() ? cause : 0];
}

std::string in_words(const ProgramVersion& version) {
  return fmt::format("{}.{}.{}", version[0], version[1], version[2]);
}

}  // namespace

void refuse_program(const Experiment& experiment, size_t segment, const wire::Nak& nak) {
  const std::string place = fmt::format("segment[{}]", segment);
  if (nak.refusal == wire::Refusal::limit_exceeded) {
    const LimitInWords words = words_for(nak.limit);
    throw InputError({experiment.file, place,
                      fmt::format("the controller refuses it: limit {}, asked {:g} {}, allowed {:g} {}",
                                  wire::limit_name(nak.limit), words.scale * static_cast<double>(nak.asked),
                                  words.unit, words.scale * static_cast<double>(nak.allowed), words.unit),
                      words.remedy});
  }
  if (nak.refusal == wire::Refusal::unknown_waveform) {
    throw InputError({experiment.file, place, "this firmware has no such waveform",
                      "Use parabolic or sinusoidal, which every firmware has, or update the firmware."});
  }
  if (nak.refusal == wire::Refusal::program_full) {
    throw InputError({experiment.file, place, "is more than the controller's program holds",
                      "Split the experiment into several runs."});
  }
  if (nak.refusal == wire::Refusal::waveform_unfit) {
    throw InputError(
        {experiment.file, place + ".points",
         "the controller refuses its waveform: it is steeper than 4294 strokes a period (squared)",
         "Smooth its points, or put them further apart."});
  }
  throw InputError({experiment.file, place,
                    fmt::format("the controller refuses it: {}", wire::refusal_explanation(nak.refusal)),
                    ""});
}

void refuse_jog(const wire::Nak& nak) {
  const auto asked = static_cast<double>(nak.asked), allowed = static_cast<double>(nak.allowed);
  switch (nak.limit) {
    case wire::Limit::flow:
      throw InputError({"", "--rate-mL-s",
                        fmt::format("is {:g}, and {:g} mL/s are allowed here", 1e-3 * asked, 1e-3 * allowed),
                        "Go slower; unhomed, the pump goes no faster than homing_flow_mL_s."});
    case wire::Limit::travel:
      throw InputError(
          {"", "--mL",
           fmt::format("would reach {:g} mL, and the travel is {:g} mL", 1e-3 * asked, 1e-3 * allowed),
           "Go less far."});
    case wire::Limit::home:
      throw InputError({"", "--mL",
                        fmt::format("would withdraw {:g} mL, and the piston stands at {:g} mL", 1e-3 * asked,
                                    1e-3 * allowed),
                        "Go less far; `diastole home` finds position 0."});
    default:
      throw InputError({"", "--mL", fmt::format("is {:g}, less than one microstep", 1e-6 * asked),
                        fmt::format("A microstep is {:g} mL.", 1e-6 * allowed)});
  }
}

std::string remedy_for(wire::Refusal refusal) {
  switch (refusal) {
    case wire::Refusal::wrong_state:
      return "A latched fault needs `diastole clear-fault` first, an unhomed pump `diastole home`; `diastole "
             "status` prints the state.";
    case wire::Refusal::estop_pressed:
      return "Make the rig safe and release the emergency stop.";
    case wire::Refusal::malformed:
      return "A number in the rig or experiment file is beyond what this firmware takes; restart the daemon "
             "after a change of the rig file.";
    case wire::Refusal::home_switch_closed:
      return "The piston stands on the home switch: jog the other way (a positive distance), or `diastole "
             "home`.";
    case wire::Refusal::settings_mismatch:
      return "Compare the rig file with `diastole settings`.";
    case wire::Refusal::supply_low:
      return "Measure the board's 3.3 V and mend its supply, then try again.";
    case wire::Refusal::motor_powered:
      return "Reset the controller, which takes the motor's current away and forgets the position; then try "
             "again before "
             "anything moves.";
    case wire::Refusal::flash_failed:
      return "Try again; if it persists the chip's flash is worn out: replace the board.";
    case wire::Refusal::limit_switch_closed:
      return "Jog away from the far limit switch (a negative distance), then `diastole home`.";
    default:
      return "`diastole status` reports more; restart the daemon if it persists.";
  }
}

std::string in_words(const wire::BlackBoxEntry& entry) {
  switch (entry.kind) {
    case wire::Noted::started:
      return fmt::format("started {}", cause_in_words(entry.detail));
    case wire::Noted::state:
      return fmt::format("{} -> {}", wire::state_name(static_cast<wire::State>(entry.argument)),
                         wire::state_name(static_cast<wire::State>(entry.detail)));
    case wire::Noted::fault: {
      const auto fault = static_cast<wire::Fault>(entry.detail);
      return fmt::format("fault {} ({}) at {} microsteps: {}", entry.detail, wire::fault_name(fault),
                         entry.argument, wire::fault_explanation(fault));
    }
    case wire::Noted::refusal:
      return fmt::format("{} refused: {}", message_name(entry.argument),
                         wire::refusal_explanation(static_cast<wire::Refusal>(entry.detail)));
    case wire::Noted::estop:
      return entry.detail != 0 ? "emergency stop pressed" : "emergency stop released";
    case wire::Noted::link:
      return entry.detail != 0 ? fmt::format("a host opened session {:04x}", entry.argument)
                               : "the host has fallen silent";
    case wire::Noted::settings:
      return fmt::format("settings written, record {}", entry.argument);
    case wire::Noted::crash: {
      const auto value = static_cast<uint32_t>(entry.argument);
      const auto which = static_cast<wire::CrashRegister>(entry.detail);
      const bool decimal = which == wire::CrashRegister::exception || which == wire::CrashRegister::cycles;
      return decimal ? fmt::format("crash before: {} {}", wire::crash_register_name(which), value)
                     : fmt::format("crash before: {} 0x{:08x}", wire::crash_register_name(which), value);
    }
    case wire::Noted::nothing:
      break;
  }
  return "nothing";
}

const ProgramVersion own_version{DIASTOLE_VERSION_MAJOR, DIASTOLE_VERSION_MINOR, DIASTOLE_VERSION_PATCH};

std::optional<VersionMismatch> compare_versions(const wire::Hello& firmware, const ProgramVersion& program,
                                                uint32_t program_schema, const std::string& port) {
  if (firmware.schema_hash == program_schema) return std::nullopt;
  const ProgramVersion found{firmware.version_major, firmware.version_minor, firmware.version_patch};
  VersionMismatch mismatch;
  mismatch.problem = fmt::format("its firmware {} speaks protocol {:08x}, this program {} speaks {:08x}",
                                 in_words(found), firmware.schema_hash, in_words(program), program_schema);
  if (found > program) {
    mismatch.remedy = fmt::format(
        "This program is the older one: install Diastole {0} on this computer (apt install "
        "./diastole_{0}_amd64.deb), then start the daemon again.",
        in_words(found));
  } else {
    mismatch.remedy = fmt::format(
        "The firmware is {}: stop the daemon and flash the one that came with this program: diastole flash "
        "/usr/share/diastole/firmware/diastole-stm32f405.image --port {}",
        found < program ? "the older one" : "another build of this version", port);
  }
  return mismatch;
}

}  // namespace diastole
