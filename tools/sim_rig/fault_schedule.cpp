#include "tools/sim_rig/fault_schedule.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <string_view>

#include "protocol/contract/input_error.hpp"

namespace diastole::sim_rig {
namespace {

constexpr double longest_s = 1e9;

bool take_off(std::string_view& text, std::string_view front) {
  if (!text.starts_with(front)) return false;
  text.remove_prefix(front.size());
  return true;
}

std::optional<double> take_number(std::string_view& text) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || !std::isfinite(number)) return std::nullopt;
  text.remove_prefix(static_cast<size_t>(end - text.data()));
  return number;
}

/// A non-negative number of seconds, with or without its unit.
std::optional<uint64_t> take_seconds(std::string_view& text) {
  const auto seconds = take_number(text);
  if (!seconds || !(*seconds >= 0 && *seconds < longest_s)) return std::nullopt;
  take_off(text, "s");
  return static_cast<uint64_t>(std::llround(*seconds * 1e9));
}

std::optional<Moment> take_moment(std::string_view& text) {
  Moment moment;
  if (take_off(text, "ttl+")) moment.origin = Origin::ttl;
  if (take_off(text, "run+")) moment.origin = Origin::run;
  const auto after_ns = take_seconds(text);
  if (!after_ns) return std::nullopt;
  moment.after_ns = *after_ns;
  return moment;
}

struct FaultText {
  std::string_view name;
  Moment on;
  std::optional<Moment> off;
  std::optional<double> value;
};

/// None if it has another form.
std::optional<FaultText> split(std::string_view text) {
  const size_t at = text.find('@');
  if (at == std::string_view::npos) return std::nullopt;
  FaultText fault{text.substr(0, at), {}, {}, {}};
  text.remove_prefix(at + 1);
  const auto on = take_moment(text);
  if (!on) return std::nullopt;
  fault.on = *on;
  if (take_off(text, "+")) {
    const auto length_ns = take_seconds(text);
    if (!length_ns) return std::nullopt;
    fault.off = Moment{on->origin, on->after_ns + *length_ns};
  }
  if (take_off(text, "/")) {
    fault.value = take_number(text);
    if (!fault.value) return std::nullopt;
  }
  if (!fault.off && take_off(text, ":off@")) {
    fault.off = take_moment(text);
    if (!fault.off) return std::nullopt;
  }
  return text.empty() ? std::optional(fault) : std::nullopt;
}

}  // namespace

std::vector<FaultSwitch> parse_faults(const std::vector<std::string>& texts) {
  std::vector<FaultSwitch> switches;
  for (const std::string& text : texts) {
    const auto fault = split(text);
    if (!fault) {
      throw InputError({"", "--fault", fmt::format("\"{}\" is not a fault with its time", text),
                        "Write NAME@T, NAME@T+LENGTH or NAME@T:off@T with times in seconds, /VALUE before "
                        ":off if it takes one; ttl+T counts from the first trigger, run+T from the start of "
                        "run. `sim_rig faults` lists the names."});
    }
    const FaultKind& kind = fault_named(fault->name);
    switches.push_back({&kind, fault->on, kind.value(fault->value)});
    if (fault->off) switches.push_back({&kind, *fault->off, std::nullopt});
  }
  return switches;
}

Moment parse_moment(const std::string& text) {
  std::string_view rest = text;
  const auto moment = take_moment(rest);
  if (moment && rest.empty()) return *moment;
  throw InputError({"", "time", fmt::format("\"{}\" is none", text),
                    "Write 12.5s, ttl+1s (after the first trigger) or run+1s (after the start of run)."});
}

}  // namespace diastole::sim_rig
