#include "host/daemon/rig_service.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <future>

#include "host/controller/black_box_text.hpp"
#include "host/controller/settings_values.hpp"
#include "host/daemon/json_rpc.hpp"
#include "host/daemon/rig_json.hpp"
#include "host/daemon/utc.hpp"
#include "host/journal/journal_store.hpp"
#include "host/transport/conducted_clock.hpp"
#include "host/transport/real_time.hpp"
#include "host/transport/serial_port.hpp"
#include "host/transport/watched_clock.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/wire/wire_text.hpp"

namespace diastole {
namespace {

using nlohmann::json;

constexpr uint64_t idle_step_ns = 20'000'000;
constexpr std::chrono::milliseconds waiting_step{50};  // while time stands still
constexpr uint64_t reconnect_interval_ns = 1'000'000'000;
constexpr uint64_t homing_patience_ns = 1'800'000'000'000;
constexpr uint64_t homing_step_ns = 10'000'000;
constexpr int conducted_timeout_ms = 5000;  // wall time; virtual time stands still meanwhile

std::unique_ptr<Clock> make_clock(const std::string& conductor, ServiceManager* manager) {
  std::unique_ptr<Clock> clock;
  if (conductor.empty()) {
    clock = std::make_unique<RealClock>();
  } else {
    clock = std::make_unique<ConductedClock>(conductor);
  }
  if (manager == nullptr) return clock;
  return std::make_unique<WatchedClock>(std::move(clock), [manager] { manager->beat(); });
}

/// Names of the bits that are set in wire::Status::inputs; an input is active when pressed, closed or unplugged.
json active_inputs(uint8_t bits) {
  constexpr std::array names{"estop", "home", "far_limit"};
  json active = json::array();
  for (size_t i = 0; i < names.size(); ++i)
    if ((bits >> i & 1U) != 0) active.push_back(names[i]);
  return active;
}

void make_journal_dir(const std::filesystem::path& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error || ::access(directory.c_str(), W_OK) != 0) {
    throw InputError({directory.string(), "", "is no directory in which journals can be written",
                      "Make it writable, or name another (journal_dir in the rig file, or --journal-dir)."});
  }
}

json schedule_as_json(const std::optional<ScheduleProgress>& schedule) {
  if (!schedule) return nullptr;
  return {{"block", schedule->block},
          {"slice", schedule->slice},
          {"slices", schedule->slices},
          {"phase", schedule->phase},
          {"cycles_left", schedule->cycles_left},
          {"prompt", schedule->prompt}};
}

[[noreturn]] void refuse_while(const std::string& activity) {
  throw rpc::Error(rpc::Code::busy,
                   fmt::format("the rig is {}; wait, or stop it first (diastole stop)", activity));
}

/// A simulated rig's instrument reads as the rig file says, whatever the real one's calibration.
CalibrationBook book_for(const RigConfig& rig, bool simulated) {
  return {simulated ? std::filesystem::path() : std::filesystem::path(rig.file), rig.daq.channels};
}

}  // namespace

RigService::RigService(RigConfig rig, const RigServiceOptions& options)
    : rig_(std::move(rig)),
      options_(options),
      book_(book_for(rig_, !options.conductor.empty())),
      clock_(make_clock(options.conductor, options.manager)) {
  rig_.daq.channels = book_.channels();
  controller_ = std::make_unique<ControllerClient>(*clock_, rig_, [this]() -> std::unique_ptr<ByteLine> {
    return std::make_unique<SerialPort>(rig_.controller.port, rig_.controller.baud);
  });
  connect();
  daq::OpenOptions opening{.address = options.daq_address};
  if (clock_->stands_still()) {
    opening.least_timeout_ms = conducted_timeout_ms;
    opening.now_ns = [this] { return clock_->now_ns(); };
  }
  instrument_ = rig_.daq.open(opening);
  if (rig_.gpio && !clock_->stands_still()) gate_ = open_gpio(*rig_.gpio);
  make_journal_dir(rig_.daemon.journal_dir);
  tidy_journals();
  spdlog::info("controller at {}, instrument {}", rig_.controller.port, instrument_->describe());
  if (controller_->settings_problem())
    spdlog::warn("{}", InputError(*controller_->settings_problem()).what());
  (void)do_status();
  (void)remember_settings();
  thread_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
}

RigService::~RigService() {
  end();
  thread_.request_stop();
  wake_.notify_all();
}

void RigService::work(const std::stop_token& stop) {
  if (!clock_->stands_still()) ask_for_real_time(rig_priority);
  while (!stop.stop_requested()) {
    try {
      if (auto order = next_order()) {
        carry_out(std::move(*order));
      } else if (clock_->stands_still()) {
        if (options_.manager != nullptr) options_.manager->beat();
        std::unique_lock lock(mutex_);
        wake_.wait_for(lock, stop, waiting_step, [this] { return !orders_.empty(); });
      } else {
        idle_turn();
      }
    } catch (const std::exception& error) {
      tell_problem(error);
    }
  }
}

void RigService::tell_problem(const std::exception& error) {
  if (std::exchange(last_problem_, error.what()) != error.what()) spdlog::error("{}", error.what());
}

void RigService::idle_turn() {
  reconnect_if_due();
  controller_->service();
  tell_events();
  clock_->sleep_until_ns(std::min(clock_->now_ns() + idle_step_ns, controller_->next_due_ns()),
                         controller_->line());
}

void RigService::reconnect_if_due() {
  if (controller_->connected() || clock_->now_ns() < next_reconnect_ns_) return;
  next_reconnect_ns_ = clock_->now_ns() + reconnect_interval_ns;
  connect();
  last_problem_.clear();
  spdlog::info("controller at {} is back", rig_.controller.port);
}

void RigService::connect() {
  controller_->connect();
  tell_events();
  if (const auto& found = controller_->found_moving()) {
    const std::string text = fmt::format(
        "the pump was found {} although nobody had ordered it since the connection was made, and was "
        "stopped; "
        "nothing of that motion was recorded",
        wire::state_name(*found));
    note({"warning", "found_moving", text});
    const std::lock_guard lock(mutex_);
    notice_ = text;
  }
  if (const wire::Status& status = controller_->last_known(); status.state == wire::State::faulted) {
    spdlog::warn("fault {} is latched: {} {}", static_cast<int>(status.fault),
                 wire::fault_explanation(status.fault), wire::fault_remedy(status.fault));
  }
}

void RigService::tell_events() {
  for (const ControllerEvent& event : controller_->take_events()) {
    if (const auto* broken = std::get_if<LinkBroken>(&event)) spdlog::error("{}", broken->reason);
    if (const auto* fault = std::get_if<wire::FaultRaised>(&event)) {
      spdlog::error("{} {}", wire::fault_explanation(fault->fault), wire::fault_remedy(fault->fault));
    }
  }
}

void RigService::give(Order order) {
  const std::lock_guard lock(mutex_);
  if (ending_) throw HardwareError("daemon", "is ending", "Start it again.");
  if (!order.activity.empty()) {
    if (!activity_.empty()) refuse_while(activity_);
    activity_ = order.activity;
    stop_request_ = StopRequest::none;
  }
  orders_.push_back(std::move(order));
  wake_.notify_all();
}

std::optional<RigService::Order> RigService::next_order() {
  const std::lock_guard lock(mutex_);
  if (orders_.empty()) return std::nullopt;
  Order order = std::move(orders_.front());
  orders_.pop_front();
  return order;
}

void RigService::carry_out(Order order) {
  json result;
  std::exception_ptr error;
  try {
    if (!order.activity.empty() && asked_to_stop()) refuse_to_start();
    if (!controller_->connected()) {
      connect();
      if (!order.activity.empty() && controller_->found_moving()) refuse_after_motion();
    }
    if (!order.activity.empty()) {
      const std::lock_guard lock(mutex_);
      notice_ = nullptr;
    }
    result = order.act();
    if (result.is_discarded()) return;
  } catch (...) {
    error = std::current_exception();
  }
  if (!order.activity.empty()) {
    const std::lock_guard lock(mutex_);
    activity_.clear();
  }
  order.done(error, std::move(result));
}

bool RigService::asked_to_stop() const {
  const std::lock_guard lock(mutex_);
  return stop_request_ != StopRequest::none;
}

void RigService::refuse_to_start() const {
  throw HardwareError("rig", "stopped before the start",
                      "Nothing moved. Give the order again when you want it.");
}

void RigService::refuse_after_motion() const {
  throw HardwareError("rig", "the pump was found moving and was stopped (diastole status)",
                      "See that nothing is amiss, then give the order again.");
}

void RigService::start_run(RunOrder order, Done done) {
  // do_run answers by itself when the run begins, long before it ends; a discarded result says so.
  give({"loading",
        [this, order = std::move(order), done] {
          do_run(order, done);
          return json(json::value_t::discarded);
        },
        done});
}

void RigService::home(Done done) {
  give({"homing", [this] { return do_home(); }, std::move(done)});
}

void RigService::clear_fault(Done done) {
  give({"clearing_fault",
        [this] {
          controller_->clear_fault();
          return do_status();
        },
        std::move(done)});
}

void RigService::jog(double distance_mL, double rate_mL_s, Done done) {
  give({"jogging", [this, distance_mL, rate_mL_s] { return do_jog(distance_mL, rate_mL_s); },
        std::move(done)});
}

void RigService::settings(Done done) {
  json snapshot;
  {
    const std::lock_guard lock(mutex_);
    if (!activity_.empty()) snapshot = last_settings_;
  }
  if (!snapshot.is_null()) return done(nullptr, std::move(snapshot));
  give({"", [this] { return remember_settings(); }, std::move(done)});
}

void RigService::write_settings(SettingsChange change, Done done) {
  give({"writing_settings",
        [this, change = std::move(change)] {
          wire::MachineSettings settings =
              change.defaults ? wire::MachineSettings{} : controller_->settings().settings;
          Attributes asked;
          for (const auto& [name, value] : change.set.items()) {
            if (value.is_string())
              asked[name] = value.get<std::string>();
            else if (value.is_number())
              asked[name] = value.get<double>();
            else
              throw InputError(
                  {"controller settings", name, value.dump() + " is no number", "Give a number."});
          }
          change_settings(settings, asked);
          controller_->write_settings(settings);
          spdlog::info("settings written: {}", values_as_json(settings_values(settings)).dump());
          (void)do_status();
          return remember_settings();
        },
        std::move(done)});
}

void RigService::black_box(Done done) {
  {
    const std::lock_guard lock(mutex_);
    if (!activity_.empty()) refuse_while(activity_);
  }
  ask(black_box_askers_, &RigService::do_black_box, std::move(done));
}

void RigService::status(Done done) {
  json snapshot;
  {
    const std::lock_guard lock(mutex_);
    if (!activity_.empty()) {
      snapshot = last_status_;
      snapshot["state"] = activity_;
      if (run_ && (activity_ == "running" || activity_ == "writing")) snapshot["run_id"] = run_->run_id;
    }
  }
  if (!snapshot.is_null()) return done(nullptr, std::move(snapshot));
  ask(status_askers_, &RigService::do_status, std::move(done));
}

void RigService::ask(std::vector<Done>& askers, json (RigService::*answer)(), Done done) {
  bool first = false;
  {
    const std::lock_guard lock(mutex_);
    first = askers.empty();
    askers.push_back(std::move(done));
  }
  if (!first) return;
  const auto answer_all = [this, &askers](const std::exception_ptr& error, const json& result) {
    std::vector<Done> all;
    {
      const std::lock_guard lock(mutex_);
      all.swap(askers);
    }
    for (const Done& asker : all)
      asker(error, result);
  };
  try {
    give({"", [this, answer] { return (this->*answer)(); }, answer_all});
  } catch (...) {
    answer_all(std::current_exception(), nullptr);
  }
}

void RigService::note(const RunRemark& what) {
  {
    const std::lock_guard lock(mutex_);
    if (activity_ == "running") return notes_.push_back(what);  // the run's remarks are logged as they come
  }
  spdlog::log(what.level == "info" ? spdlog::level::info : spdlog::level::warn, "{}", what.text);
}

void RigService::keep(const RunRemark& remark) {
  const std::lock_guard lock(mutex_);
  run_->remarks.add(remark, utc_now());
}

bool RigService::stop(StopRequest how) {
  const std::lock_guard lock(mutex_);
  stop_request_ = std::max(stop_request_, how);
  return !activity_.empty() && activity_ != "writing";
}

json RigService::continue_run(std::optional<size_t> slice) {
  const std::lock_guard lock(mutex_);
  const auto* schedule =
      run_ && run_->state == "running" && run_->progress.schedule ? &*run_->progress.schedule : nullptr;
  if (schedule == nullptr || schedule->phase != "waiting") return {{"continued", false}};
  const auto waited_for = static_cast<size_t>(schedule->slice);
  if (slice && *slice != waited_for) return {{"continued", false}};
  go_on_ = waited_for;
  return {{"continued", true}, {"slice", waited_for}, {"prompt", schedule->prompt}};
}

void RigService::end() {
  const std::lock_guard lock(mutex_);
  ending_ = true;
  stop_request_ = StopRequest::now;
}

bool RigService::idle() const {
  const std::lock_guard lock(mutex_);
  return activity_.empty() && orders_.empty();
}

json RigService::run_progress(size_t first_remark) const {
  const std::lock_guard lock(mutex_);
  if (!run_) return nullptr;
  const auto [remarks, next_remark] = run_->remarks.from(first_remark, remarks_at_once);
  return {{"run_id", run_->run_id},
          {"state", run_->state},
          {"planned_s", run_->estimate_s},
          {"planned_cycles", run_->planned_cycles},
          {"received", run_->progress.received},
          {"missing", run_->progress.missing},
          {"triggers", run_->progress.triggers},
          {"gate_pulses", run_->progress.gate_pulses ? json(*run_->progress.gate_pulses) : json()},
          {"last_kPa", run_->progress.last_kPa},
          {"filtered_kPa", run_->progress.filtered_kPa},
          {"schedule", schedule_as_json(run_->progress.schedule)},
          {"remarks", remarks},
          {"next_remark", next_remark},
          {"result", run_->result}};
}

bool RigService::await_end_of(wire::State moving) {
  const uint64_t end_ns = clock_->now_ns() + homing_patience_ns;
  StopRequest obeyed = StopRequest::none;
  for (wire::Status status = controller_->status(); status.state == moving; status = controller_->status()) {
    (void)remember(status);
    StopRequest asked = clock_->now_ns() > end_ns ? StopRequest::halt : StopRequest::none;
    {
      const std::lock_guard lock(mutex_);
      asked = std::max(asked, stop_request_);
    }
    if (asked > obeyed) asked == StopRequest::halt ? controller_->halt() : controller_->stop_now();
    obeyed = std::max(asked, obeyed);
    for (const uint64_t until_ns = clock_->now_ns() + homing_step_ns; clock_->now_ns() < until_ns;) {
      clock_->sleep_until_ns(std::min(until_ns, controller_->next_due_ns()), controller_->line());
      controller_->service();
    }
  }
  controller_->take_events();
  return obeyed != StopRequest::none;
}

json RigService::do_home() {
  controller_->home();
  const bool stopped = await_end_of(wire::State::homing);
  json result = do_status();
  if (stopped && result["state"] == "unhomed") {
    throw HardwareError("rig", "homing was stopped",
                        "The pump does not know its place: `diastole home` again.");
  }
  if (result["state"] != "homed") {
    throw HardwareError("controller at " + rig_.controller.port,
                        fmt::format("homing ended in state {}: {}", result["state"].get<std::string>(),
                                    result["fault_text"].get<std::string>()),
                        result["remedy"].get<std::string>());
  }
  return result;
}

json RigService::do_jog(double distance_mL, double rate_mL_s) {
  const int32_t before = controller_->status().position_microsteps;
  controller_->jog(distance_mL, rate_mL_s);
  const bool stopped = await_end_of(wire::State::jogging);
  const int32_t after = controller_->status().position_microsteps;
  json result = do_status();
  if (!result["fault"].is_null()) {
    throw HardwareError("controller at " + rig_.controller.port,
                        "the jog ended with a fault: " + result["fault_text"].get<std::string>(),
                        result["remedy"].get<std::string>());
  }
  result["jogged_mL"] = 1e-9 * controller_->microstep_pL() * (after - before);
  result["stopped"] = stopped;
  return result;
}

json RigService::remember_settings() {
  const wire::SettingsReport& report = controller_->settings();
  const auto& problem = controller_->settings_problem();
  json result{{"record", report.records_written},
              {"settings", values_as_json(settings_values(report.settings))},
              {"microstep_uL", 1e-6 * controller_->microstep_pL()},
              {"backlash_microsteps", report.backlash_microsteps},
              {"problem", problem ? json(InputError(*problem).what()) : json()}};
  const std::lock_guard lock(mutex_);
  last_settings_ = result;
  return result;
}

json RigService::do_black_box() {
  const double tick_rate_Hz = controller_->hello().tick_rate_Hz;
  json entries = json::array();
  for (const wire::BlackBoxEntry& entry : controller_->black_box()) {
    entries.push_back({{"number", entry.number},
                       {"boot", entry.boot},
                       {"time_s", static_cast<double>(entry.tick) / tick_rate_Hz},
                       {"kind", wire::noted_name(entry.kind)},
                       {"text", in_words(entry)}});
  }
  const bool since_power_on = !entries.empty() && entries.front()["number"] == 1;
  return {{"entries", entries}, {"since_power_on", since_power_on}};
}

json RigService::do_status() { return remember(controller_->status()); }

json RigService::remember(const wire::Status& status) {
  const wire::Hello& hello = controller_->hello();
  const auto& problem = controller_->settings_problem();
  const double position_mL =
      1e-9 * static_cast<double>(controller_->microstep_pL()) * status.position_microsteps;
  json result{
      {"state", wire::state_name(status.state)},
      {"fault", status.fault == wire::Fault::none ? json() : json(wire::fault_name(status.fault))},
      {"fault_number", static_cast<int>(status.fault)},
      {"fault_text", wire::fault_explanation(status.fault)},
      {"remedy", wire::fault_remedy(status.fault)},
      {"firmware", fmt::format("{}.{}.{}", hello.version_major, hello.version_minor, hello.version_patch)},
      {"board", hello.board_id},
      {"boot_id", hello.boot_id},
      {"position_mL", position_mL},
      {"inputs", active_inputs(status.inputs)},
      {"motor_powered", (status.inputs & 8U) != 0},
      {"segment", status.segment},
      {"cycles", status.cycle},
      {"triggers", status.triggers},
      {"r_waves", status.r_waves},
      {"steps", status.steps},
      {"link", {{"crc_errors", status.crc_errors}, {"retransmissions", status.retransmissions}}},
      {"settings_problem", problem ? json(InputError(*problem).what()) : json()},
      {"controller", rig_.controller.port},
      {"instrument", instrument_->describe()}};
  const std::lock_guard lock(mutex_);
  result["journals"] = journals_;
  result["notice"] = notice_;
  last_status_ = result;
  return result;
}

void RigService::beside_the_line(const std::function<void()>& work) {
  auto done = std::async(std::launch::async, work);
  while (!clock_->stands_still() && done.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    try {
      idle_turn();
    } catch (const std::exception& error) {
      tell_problem(error);
    }
  }
  done.get();
}

}  // namespace diastole
