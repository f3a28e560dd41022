#include "tools/sim_rig/rig_faults.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "protocol/contract/input_error.hpp"

namespace diastole::sim_rig {
namespace {

constexpr std::string_view after_ttl = "ttl+";

struct FaultText {
  std::string kind;
  bool from_ttl = false;
  uint64_t from_ns = 0;
  std::optional<uint64_t> length_ns;
  std::optional<uint64_t> delay_ns;
};

/// Takes a non-negative number of seconds off the front of `text`; none if there is no number.
std::optional<uint64_t> take_seconds(std::string_view& text) {
  double seconds = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seconds);
  if (error != std::errc() || !(seconds >= 0 && seconds < 1e9)) return std::nullopt;
  text.remove_prefix(static_cast<size_t>(end - text.data()));
  return static_cast<uint64_t>(std::llround(seconds * 1e9));
}

/// Splits KIND@[ttl+]T[+D][/L]; none if it has another form.
std::optional<FaultText> split(std::string_view text) {
  const size_t at = text.find('@');
  if (at == std::string_view::npos) return std::nullopt;
  FaultText fault{std::string(text.substr(0, at)), false, 0, {}, {}};
  text.remove_prefix(at + 1);
  fault.from_ttl = text.starts_with(after_ttl);
  if (fault.from_ttl) text.remove_prefix(after_ttl.size());
  const auto from_ns = take_seconds(text);
  if (!from_ns) return std::nullopt;
  fault.from_ns = *from_ns;
  for (auto [sign, value] : {std::pair{'+', &fault.length_ns}, std::pair{'/', &fault.delay_ns}}) {
    if (!text.starts_with(sign)) continue;
    text.remove_prefix(1);
    *value = take_seconds(text);
    if (!*value) return std::nullopt;
  }
  return text.empty() ? std::optional(fault) : std::nullopt;
}

[[noreturn]] void fail(const std::string& text) {
  throw InputError({"", "--fault", fmt::format("\"{}\" is not a fault", text),
                    "Write serial-hangup@T, daq-stall@T+D, daq-drop@T+D or daq-delay@T+D/L with times in "
                    "seconds; for the instrument's, ttl+T counts from the first trigger."});
}

}  // namespace

RigFaults parse_rig_faults(const std::vector<std::string>& texts) {
  RigFaults faults;
  for (const std::string& text : texts) {
    const auto fault = split(text);
    if (!fault) fail(text);
    const sim_daq::FaultWindow window{fault->from_ns, fault->from_ns + fault->length_ns.value_or(0)};
    const bool only_a_time = !fault->length_ns && !fault->delay_ns;
    sim_daq::DaqFaults& daq = fault->from_ttl ? faults.daq_from_ttl : faults.daq;
    const bool only_a_window = fault->length_ns && !fault->delay_ns;
    if (fault->kind == "serial-hangup" && only_a_time && !fault->from_ttl) {
      faults.serial_hangup_ns = fault->from_ns;
    } else if (fault->kind == "daq-stall" && only_a_window) {
      daq.stall = window;
    } else if (fault->kind == "daq-drop" && only_a_window) {
      daq.drop = window;
    } else if (fault->kind == "daq-delay" && fault->length_ns && fault->delay_ns) {
      daq.delay = window;
      daq.delay_ns = *fault->delay_ns;
    } else {
      fail(text);
    }
  }
  return faults;
}

}  // namespace diastole::sim_rig
