#include "protocol/contract/input_error.hpp"

#include <fmt/format.h>

#include <utility>

namespace diastole {
namespace {

std::string message_of(const InputFault& fault) {
  std::string text;
  for (const std::string& part : {fault.file, fault.place}) {
    if (!part.empty()) text += part + ": ";
  }
  text += fault.problem;
  if (!fault.remedy.empty()) text += "\n  " + fault.remedy;
  return text;
}

}  // namespace

InputError::InputError(InputFault fault) : std::runtime_error(message_of(fault)), fault_(std::move(fault)) {}

HardwareError::HardwareError(std::string device, std::string problem, std::string remedy)
    : std::runtime_error(fmt::format("{}: {}\n  {}", device, problem, remedy)) {}

}  // namespace diastole
