#include "protocol/runfile/signal_delay.hpp"

#include <numbers>
#include <optional>

namespace diastole::runfile {
namespace {

std::optional<double> number_in(const std::map<std::string, Attribute, std::less<>>& attributes,
                                std::string_view name) {
  const auto found = attributes.find(name);
  if (found == attributes.end()) return std::nullopt;
  if (const auto* whole = std::get_if<int64_t>(&found->second)) return static_cast<double>(*whole);
  const auto* number = std::get_if<double>(&found->second);
  return number == nullptr ? std::nullopt : std::optional(*number);
}

}  // namespace

SignalDelay signal_delay(const RecordedRun& run, std::string_view channel) {
  SignalDelay delay;
  const auto f0_Hz = number_in(run.rig, "catheter_f0_Hz");
  const auto zeta = number_in(run.rig, "catheter_zeta");
  if (channel.starts_with("cavity") && f0_Hz && zeta && *f0_Hz > 0 && *zeta > 0) {
    delay.catheter_s = *zeta / (std::numbers::pi * *f0_Hz);
  }
  if (const auto notes = run.pressure.notes.find(channel); notes != run.pressure.notes.end()) {
    delay.filter_s = number_in(notes->second, "delay_s").value_or(0);
  }
  return delay;
}

}  // namespace diastole::runfile
