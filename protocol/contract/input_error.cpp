#include "protocol/contract/input_error.hpp"

#include <fmt/format.h>

#include <utility>

namespace diastole {
namespace {

/// Control characters that a file holds would act on the terminal.
std::string printable(const std::string& text) {
  constexpr unsigned first_printable = 0x20, deleted = 0x7F;
  std::string out;
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    const bool is_printed = (code >= first_printable && code != deleted) || c == '\n' || c == '\t';
    out += is_printed ? std::string(1, c) : fmt::format("\\x{:02X}", code);
  }
  return out;
}

std::string message_of(const InputFault& fault) {
  std::string text;
  for (const std::string& part : {fault.file, fault.place}) {
    if (!part.empty()) text += part + ": ";
  }
  text += fault.problem;
  if (!fault.remedy.empty()) text += "\n  " + fault.remedy;
  return printable(text);
}

}  // namespace

InputError::InputError(InputFault fault) : std::runtime_error(message_of(fault)), fault_(std::move(fault)) {}

HardwareError::HardwareError(std::string device, std::string problem, std::string remedy)
    : std::runtime_error(fmt::format("{}: {}\n  {}", device, problem, remedy)) {}

}  // namespace diastole
