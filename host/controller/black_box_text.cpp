#include "host/controller/black_box_text.hpp"

#include <fmt/format.h>

#include <array>
#include <string_view>

#include "protocol/wire/message_type.hpp"
#include "protocol/wire/wire_text.hpp"

namespace diastole {
namespace {

std::string_view message_name(int32_t type) {
  switch (static_cast<wire::MessageType>(type)) {
#define DIASTOLE_MESSAGE(number, name, sender, delivery) \
  case wire::MessageType::name:                          \
    return #name;
#include "protocol/wire/message_list.inc"
#undef DIASTOLE_MESSAGE
  }
  return "unknown";
}

std::string_view cause_in_words(uint8_t cause) {
  constexpr std::array<std::string_view, 5> words{"for an unknown reason", "at power-on", "by the reset pin",
                                                  "by software", "by the watchdog"};
  return words[cause < words.size() ? cause : 0];
}

}  // namespace

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
    case wire::Noted::nothing:
      break;
  }
  return "nothing";
}

}  // namespace diastole
