#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "protocol/runfile/soundness.hpp"
#include "tools/diastole/replay/replay_plan.hpp"

namespace diastole::replay {
namespace {

using runfile::Event;
using runfile::RecordedRun;
using runfile::RunFile;
using runfile::Series;

constexpr double shortest_s = 1e-3;  ///< after the start of run
constexpr double silence_timeout_s = 1;
constexpr const char* was_reset = "was reset";
constexpr double reboot_s = 5e-3;
constexpr double before_noticed_s =
    1e-6;  ///< the controller's main loop notes a fault in the turn that sees it

std::string fault_from(const char* name, double from_s, std::optional<double> until_s = {}) {
  std::string text = fmt::format("{}@run+{:.9f}s", name, std::max(from_s, shortest_s));
  if (until_s) text += fmt::format(":off@run+{:.9f}s", std::max(*until_s, shortest_s));
  return text;
}

/// When the controller was last heard; what it reported in the run's last moments may have got lost with it.
double last_heard_s(const RunFile& file) {
  constexpr double on_the_line_s = 2e-3;
  const Series& positions_s = file.rows.pump.time_s;
  const double position_s = positions_s.size() == 0 ? 0 : positions_s.back();
  const double trigger_s = file.run.trigger_s.empty() ? 0 : file.run.trigger_s.back();
  return std::max(position_s, trigger_s) + on_the_line_s;
}

/// The cable or supply that explains why the host lost the controller.
void plan_link_loss(const RunFile& file, const Event& event, double onset_shift_s, ReplayPlan& plan) {
  const auto says = [&](const char* words) { return event.text.find(words) != std::string::npos; };
  if (says(was_reset)) {
    const double booted_s = event.time_s - reboot_s + onset_shift_s;
    plan.faults.push_back(
        fault_from("power-cut", std::min(booted_s - reboot_s, last_heard_s(file)), booted_s));
    plan.remarks.emplace_back(
        "when and why the controller was reset is not in the file: its supply is cut after what was last "
        "heard of it, such that the host notices when it did");
  } else if (says("fallen silent")) {
    plan.faults.push_back(fault_from("serial-silence", event.time_s - silence_timeout_s));
  } else {
    plan.faults.push_back(fault_from("serial-hangup", event.time_s));
  }
}

/// The controller's end came when it heard the host again, and the recording ends a quarter of a second behind that.
double heard_again_s(const RunFile& file, const Event& event) {
  constexpr double tail_s = 0.26;
  const Series& samples_s = file.rows.pressure.time_s;
  return samples_s.size() == 0 ? event.time_s : std::max(event.time_s, samples_s.back() - tail_s);
}

void plan_fault(const RunFile& file, const Event& event, double onset_shift_s, ReplayPlan& plan) {
  const std::string& code = event.code;
  if (code == "estop") {
    plan.faults.push_back(fault_from("estop", event.time_s - before_noticed_s));
  } else if (code == "limit_switch") {
    plan.faults.push_back(fault_from("far-limit", event.time_s - before_noticed_s));
  } else if (code == "home_switch") {
    plan.faults.push_back(fault_from("home-limit", event.time_s - before_noticed_s));
  } else if (code == "lease_lost") {
    const double lease_s = 1e-3 * rig_number(file.run, "lease_ms").value_or(500);
    const double silent_s = event.time_s - lease_s + shortest_s + onset_shift_s;
    plan.faults.push_back(fault_from("serial-deaf", silent_s, heard_again_s(file, event)));
    plan.remarks.emplace_back(
        "when the host fell silent is not in the file: such that the lease ends when it did");
  } else if (code == "link_lost") {
    plan_link_loss(file, event, onset_shift_s, plan);
  } else if (code == "journal_failed" || code == "overdue" || code == "refused") {
    plan.remarks.push_back(
        fmt::format("{:.3f} s: {} is a matter of the recording's own computer and is not done again",
                    event.time_s, code));
  } else if (is_controller_fault(code) && code != "halted") {
    plan.remarks.push_back(fmt::format(
        "{:.3f} s: nothing outside the controller makes {} happen; the replay shows whether it does it again",
        event.time_s, code));
  }
}

void plan_stop(const Event& event, ReplayPlan& plan) {
  const auto says = [&](const char* words) { return event.text.find(words) != std::string::npos; };
  const auto kind = says("end of this cycle") ? Order::Kind::stop_at_cycle_end
                    : says("halt")            ? Order::Kind::halt
                                              : Order::Kind::stop_now;
  plan.orders.push_back({kind, event.time_s, 0});
}

/// The operator was ready between the trigger before a slice's first (dummy) cycle and that cycle.
void plan_slices(const RecordedRun& run, ReplayPlan& plan) {
  constexpr double after_trigger_s = 0.05;  // the daemon has taken it in
  for (size_t i = 0; i < run.slices.size(); ++i) {
    const int64_t first = run.slices[i].first_trigger - run.slices[i].dummy_cycles;
    if (first >= std::ssize(run.trigger_s)) continue;
    const double before_s = first <= 0 ? 0 : run.trigger_s[static_cast<size_t>(first - 1)];
    const double own_s = run.trigger_s[static_cast<size_t>(std::max<int64_t>(first, 0))];
    plan.orders.push_back(
        {Order::Kind::go_on, std::min(before_s + after_trigger_s, 0.5 * (before_s + own_s)), i});
  }
}

}  // namespace

bool is_controller_fault(const std::string& code) {
  static constexpr std::array names{
#define DIASTOLE_FAULT(number, name, explanation, remedy) std::string_view(#name),
#include "protocol/wire/fault_list.inc"
  };
  return code != "none" && std::ranges::find(names, code) != names.end();
}

std::string end_of(const RecordedRun& run) {
  static constexpr std::array broken{"link_lost", "journal_failed", "overdue", "refused"};
  std::string end = "completed";
  for (const Event& event : run.events) {
    if (runfile::is_stop_on_request(event.code)) end = event.code;
    if (is_controller_fault(event.code)) end = "faulted: " + event.code;
    if (std::ranges::find(broken, event.code) != broken.end()) end = event.code;
    if (event.code == "incomplete" && end == "completed") end = event.code;
  }
  return end;
}

void plan_happenings(const RunFile& file, double onset_shift_s, ReplayPlan& plan) {
  plan_slices(file.run, plan);
  for (const Event& event : file.run.events) {
    if (event.code == "stop") plan_stop(event, plan);
    if (event.level == "error") plan_fault(file, event, onset_shift_s, plan);
  }
  std::ranges::stable_sort(plan.orders, {}, &Order::time_s);
}

std::optional<Event> late_sign(const RecordedRun& run) {
  for (const Event& event : run.events) {
    const bool reset = event.code == "link_lost" && event.text.find(was_reset) != std::string::npos;
    if (reset || event.code == "lease_lost") return event;
  }
  return std::nullopt;
}

ReplayPlan plan_replay(const RunFile& file, const PlanOptions& options) {
  ReplayPlan plan;
  plan_experiment(file, plan);
  plan_rig(file, options.limits, plan);
  plan_happenings(file, options.onset_shift_s, plan);
  return plan;
}

}  // namespace diastole::replay
