#include "tools/sim_rig/rig_faults.hpp"

#include <fmt/format.h>

#include <cmath>
#include <regex>

#include "protocol/contract/input_error.hpp"

namespace diastole::sim_rig {
namespace {

uint64_t ns_of(const std::string& seconds) {
  return static_cast<uint64_t>(std::llround(std::stod(seconds) * 1e9));
}

[[noreturn]] void fail(const std::string& text) {
  throw InputError({"", "--fault", fmt::format("\"{}\" is not a fault", text),
                    "Write serial-hangup@T, daq-stall@T+D, daq-drop@T+D or daq-delay@T+D/L with times in "
                    "seconds."});
}

}  // namespace

RigFaults parse_rig_faults(const std::vector<std::string>& texts) {
  static const std::regex form(R"(([a-z-]+)@(\d+\.?\d*)(?:\+(\d+\.?\d*))?(?:/(\d+\.?\d*))?)");
  RigFaults faults;
  for (const std::string& text : texts) {
    std::smatch part;
    if (!std::regex_match(text, part, form)) fail(text);
    const std::string kind = part[1];
    const bool has_length = part[3].matched;
    const bool has_delay = part[4].matched;
    const uint64_t from_ns = ns_of(part[2]);
    const uint64_t until_ns = from_ns + (has_length ? ns_of(part[3]) : 0);
    if (kind == "serial-hangup" && !has_length && !has_delay) {
      faults.serial_hangup_ns = from_ns;
    } else if (kind == "daq-stall" && has_length && !has_delay) {
      faults.daq.stall = {from_ns, until_ns};
    } else if (kind == "daq-drop" && has_length && !has_delay) {
      faults.daq.drop = {from_ns, until_ns};
    } else if (kind == "daq-delay" && has_length && has_delay) {
      faults.daq.delay = {from_ns, until_ns};
      faults.daq.delay_ns = ns_of(part[4]);
    } else {
      fail(text);
    }
  }
  return faults;
}

}  // namespace diastole::sim_rig
