#include "host/rig/rig_service.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <mutex>

#include "host/calibration/at_rest.hpp"
#include "host/controller/settings_values.hpp"
#include "host/transport/conducted_clock.hpp"
#include "host/transport/real_time.hpp"
#include "host/transport/serial_port.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/wire/wire_text.hpp"

namespace diastole {
namespace {

constexpr double at_rest_rate_Hz = 300;

bool asks_for(const CalibrationOrder& order, const std::string& channel) {
  return order.channels.empty() ||
         std::find(order.channels.begin(), order.channels.end(), channel) != order.channels.end();
}

constexpr uint64_t idle_step_ns = 20'000'000;
constexpr std::chrono::milliseconds waiting_step{50};  // while time stands still
constexpr uint64_t reconnect_interval_ns = 1'000'000'000;
constexpr uint64_t homing_timeout_ns = 1'800'000'000'000;
constexpr uint64_t homing_step_ns = 10'000'000;
constexpr int conducted_timeout_ms = 5000;  // wall time; virtual time stands still meanwhile

/// Calls `on_sleep` each time its user goes to sleep: proof that a loop goes on.
class WatchedClock final : public Clock {
 public:
  WatchedClock(std::unique_ptr<Clock> clock, std::function<void()> on_sleep)
      : clock_(std::move(clock)), on_sleep_(std::move(on_sleep)) {}

  [[nodiscard]] uint64_t now_ns() override { return clock_->now_ns(); }
  void sleep_until_ns(uint64_t until_ns, ByteLine* line) override {
    on_sleep_();
    clock_->sleep_until_ns(until_ns, line);
  }
  void line_opened(ByteLine& line) override { clock_->line_opened(line); }
  [[nodiscard]] bool stands_still() const override { return clock_->stands_still(); }

 private:
  std::unique_ptr<Clock> clock_;
  std::function<void()> on_sleep_;
};

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

void make_journal_dir(const std::filesystem::path& directory) {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error || ::access(directory.c_str(), W_OK) != 0) {
    throw InputError({directory.string(), "", "is no directory in which journals can be written",
                      "Make it writable, or name another (journal_dir in the rig file, or --journal-dir)."});
  }
}

std::optional<std::string> problem_of(const ControllerClient& controller) {
  const auto& problem = controller.settings_problem();
  return problem ? std::optional<std::string>(InputError(*problem).what()) : std::nullopt;
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
  if (const auto problem = problem_of(*controller_)) spdlog::warn("{}", *problem);
  (void)do_status();
  (void)remember_settings();
  thread_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
}

RigService::~RigService() {
  end();
  thread_.request_stop();
  queue_.wake();
}

void RigService::work(const std::stop_token& stop) {
  if (!clock_->stands_still()) ask_for_real_time(rig_priority);
  while (!stop.stop_requested()) {
    try {
      if (auto order = queue_.next()) {
        carry_out(std::move(*order));
      } else if (clock_->stands_still()) {
        if (options_.manager != nullptr) options_.manager->beat();
        queue_.wait(stop, waiting_step);
      } else {
        idle_turn();
      }
    } catch (const std::exception& error) {
      log_problem(error);
    }
  }
}

void RigService::log_problem(const std::exception& error) {
  if (std::exchange(last_problem_, error.what()) != error.what()) spdlog::error("{}", error.what());
}

void RigService::idle_turn() {
  reconnect_if_due();
  controller_->service();
  log_events();
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
  log_events();
  if (const auto& found = controller_->found_moving()) {
    const std::string text = fmt::format(
        "the pump was found {} although nobody had ordered it since the connection was made, and was "
        "stopped; nothing of that motion was recorded",
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

void RigService::log_events() {
  for (const ControllerEvent& event : controller_->take_events()) {
    if (const auto* broken = std::get_if<LinkBroken>(&event)) spdlog::error("{}", broken->reason);
    if (const auto* fault = std::get_if<wire::FaultRaised>(&event)) {
      spdlog::error("{} {}", wire::fault_explanation(fault->fault), wire::fault_remedy(fault->fault));
    }
  }
}

void RigService::carry_out(RigOrder order) {
  const bool occupies = !order.activity.empty();
  std::optional<RigAnswer> answer;
  std::exception_ptr error;
  try {
    if (occupies && asked_to_stop()) refuse_to_start();
    if (!controller_->connected()) {
      connect();
      if (occupies && controller_->found_moving()) {
        throw HardwareError("rig", "the pump was found moving and was stopped (diastole status)",
                            "See that nothing is amiss, then give the order again.");
      }
    }
    if (occupies) {
      const std::lock_guard lock(mutex_);
      notice_.reset();
    }
    answer = order.act();
    if (!answer) return;
  } catch (...) {
    error = std::current_exception();
  }
  if (occupies) queue_.leave();
  order.done(error, answer.value_or(RigAnswer()));
}

void RigService::refuse_to_start() const {
  throw HardwareError("rig", "stopped before the start",
                      "Nothing moved. Give the order again when you want it.");
}

void RigService::start_run(RunOrder order, Done done) {
  // do_run answers by itself when the run begins, long before it ends.
  queue_.give({"loading",
               [this, order = std::move(order), done]() mutable -> std::optional<RigAnswer> {
                 do_run(std::move(order), done);
                 return std::nullopt;
               },
               done});
}

void RigService::home(Done done) {
  queue_.give({"homing", [this] { return do_home(); }, std::move(done)});
}

void RigService::clear_fault(Done done) {
  queue_.give({"clearing_fault",
               [this] {
                 controller_->clear_fault();
                 return do_status();
               },
               std::move(done)});
}

void RigService::jog(double distance_mL, double rate_mL_s, Done done) {
  queue_.give({"jogging", [this, distance_mL, rate_mL_s] { return do_jog(distance_mL, rate_mL_s); },
               std::move(done)});
}

void RigService::settings(Done done) {
  if (queue_.activity().empty())
    return queue_.give({"", [this] { return remember_settings(); }, std::move(done)});
  std::unique_lock lock(mutex_);
  const SettingsReport last = last_settings_;
  lock.unlock();
  done(nullptr, last);
}

void RigService::write_settings(SettingsChange change, Done done) {
  queue_.give({"writing_settings",
               [this, change = std::move(change)] {
                 wire::MachineSettings settings =
                     change.defaults ? wire::MachineSettings{} : controller_->settings().settings;
                 change_settings(settings, change.set);
                 controller_->write_settings(settings);
                 (void)do_status();
                 const SettingsReport report = remember_settings();
                 spdlog::info("settings written: record {}", report.record);
                 return report;
               },
               std::move(done)});
}

void RigService::black_box(Done done) {
  queue_.require_free();
  const auto read = [this] {
    return BlackBox{controller_->black_box(), static_cast<double>(controller_->hello().tick_rate_Hz)};
  };
  ask(black_box_requests_, read, std::move(done));
}

void RigService::status(Done done) {
  const std::string activity = queue_.activity();
  if (activity.empty())
    return ask(
        status_requests_, [this] { return do_status(); }, std::move(done));
  std::unique_lock lock(mutex_);
  RigStatus last = last_status_;
  lock.unlock();
  last.state = activity;
  if (activity == "running" || activity == "writing") last.run_id = run_.run_id();
  done(nullptr, last);
}

void RigService::ask(std::vector<Done>& waiting, std::function<RigAnswer()> answer, Done done) {
  {
    const std::lock_guard lock(mutex_);
    waiting.push_back(std::move(done));
    if (waiting.size() > 1) return;
  }
  const auto answer_all = [this, &waiting](const std::exception_ptr& error, const RigAnswer& what) {
    std::vector<Done> all;
    {
      const std::lock_guard lock(mutex_);
      all.swap(waiting);
    }
    for (const Done& reply : all)
      reply(error, what);
  };
  try {
    queue_.give({"", std::move(answer), answer_all});
  } catch (...) {
    answer_all(std::current_exception(), {});
  }
}

void RigService::note(const RunRemark& what) {
  if (queue_.activity() == "running") return run_.note(what);  // the run's remarks are logged as they come
  spdlog::log(what.level == "info" ? spdlog::level::info : spdlog::level::warn, "{}", what.text);
}

bool RigService::await_end_of(wire::State moving) {
  const uint64_t end_ns = clock_->now_ns() + homing_timeout_ns;
  StopRequest obeyed = StopRequest::none;
  for (wire::Status status = controller_->status(); status.state == moving; status = controller_->status()) {
    (void)remember(status);
    const StopRequest overdue = clock_->now_ns() > end_ns ? StopRequest::halt : StopRequest::none;
    const StopRequest asked = std::max(overdue, queue_.stop_asked());
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

RigStatus RigService::do_home() {
  controller_->home();
  const bool stopped = await_end_of(wire::State::homing);
  const RigStatus result = do_status();
  const wire::State state = result.controller.state;
  if (stopped && state == wire::State::unhomed) {
    throw HardwareError("rig", "homing was stopped",
                        "The pump does not know its place: `diastole home` again.");
  }
  if (state != wire::State::homed) {
    const wire::Fault fault = result.controller.fault;
    throw HardwareError(
        "controller at " + rig_.controller.port,
        fmt::format("homing ended in state {}: {}", result.state, wire::fault_explanation(fault)),
        std::string(wire::fault_remedy(fault)));
  }
  return result;
}

RigStatus RigService::do_jog(double distance_mL, double rate_mL_s) {
  const int32_t before = controller_->status().position_microsteps;
  controller_->jog(distance_mL, rate_mL_s);
  const bool stopped = await_end_of(wire::State::jogging);
  const int32_t after = controller_->status().position_microsteps;
  RigStatus result = do_status();
  if (const wire::Fault fault = result.controller.fault; fault != wire::Fault::none) {
    throw HardwareError("controller at " + rig_.controller.port,
                        fmt::format("the jog ended with a fault: {}", wire::fault_explanation(fault)),
                        std::string(wire::fault_remedy(fault)));
  }
  result.jog = {1e-9 * controller_->microstep_pL() * (after - before), stopped};
  return result;
}

SettingsReport RigService::remember_settings() {
  const wire::SettingsReport& report = controller_->settings();
  const SettingsReport result{report.records_written, settings_values(report.settings),
                              1e-6 * controller_->microstep_pL(), report.backlash_microsteps,
                              problem_of(*controller_)};
  const std::lock_guard lock(mutex_);
  return last_settings_ = result;
}

RigStatus RigService::do_status() { return remember(controller_->status()); }

RigStatus RigService::remember(const wire::Status& status) {
  const double microstep_mL = 1e-9 * static_cast<double>(controller_->microstep_pL());
  RigStatus result{.state = std::string(wire::state_name(status.state)),
                   .controller = status,
                   .firmware = controller_->hello(),
                   .position_mL = microstep_mL * status.position_microsteps,
                   .port = rig_.controller.port,
                   .instrument = instrument_->describe(),
                   .settings_problem = problem_of(*controller_),
                   .notice = {},
                   .journals = {}};
  const std::lock_guard lock(mutex_);
  result.journals = journals_;
  result.notice = notice_;
  return last_status_ = result;
}

void RigService::beside_the_line(const std::function<void()>& work) {
  auto done = std::async(std::launch::async, work);
  while (!clock_->stands_still() && done.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    try {
      idle_turn();
    } catch (const std::exception& error) {
      log_problem(error);
    }
  }
  done.get();
}

void RigService::self_test(double seconds, Done done) {
  queue_.give({"self_testing", [this, seconds] { return do_self_test(seconds); }, std::move(done)});
}

SelfTestResult RigService::do_self_test(double seconds) {
  using enum wire::SelfTestItem;
  SelfTestReadings readings;
  readings.tick_rate_Hz = static_cast<double>(controller_->hello().tick_rate_Hz);
  controller_->take_events();
  readings.supply = controller_->self_test(supply);
  for (const uint16_t code : self_test_codes)
    readings.levels.push_back(controller_->self_test(level, code));
  for (int i = 0; i < self_test_pulses; ++i)
    readings.pulses.push_back(controller_->self_test(pulse));
  readings.steps = controller_->self_test(steps, self_test_steps);
  const uint64_t end_ns = clock_->now_ns() + static_cast<uint64_t>(1e9 * seconds);
  while (clock_->now_ns() < end_ns) {
    if (asked_to_stop()) throw HardwareError("rig", "the self-test was stopped", "Nothing moved.");
    clock_->sleep_until_ns(std::min(end_ns, controller_->next_due_ns()), controller_->line());
    controller_->service();
    for (const ControllerEvent& event : controller_->take_events()) {
      if (const auto* broken = std::get_if<LinkBroken>(&event))
        throw HardwareError("controller at " + rig_.controller.port, broken->reason,
                            "Check the cable, then try again.");
      if (const auto* reading = std::get_if<ClockReading>(&event))
        readings.clock.push_back({1e-9 * static_cast<double>(reading->host_ns),
                                  static_cast<double>(reading->tick) / readings.tick_rate_Hz,
                                  1e-9 * static_cast<double>(reading->half_round_trip_ns)});
    }
  }
  (void)do_status();
  return {judge(readings)};
}

void RigService::calibrate(CalibrationOrder order, Done done) {
  queue_.give({order.kPa ? "calibrating" : "zeroing",
               [this, order = std::move(order)] { return do_calibrate(order); }, std::move(done)});
}

CalibrationReport RigService::do_calibrate(const CalibrationOrder& order) {
  CalibrationBook changed = book_;
  for (const std::string& channel : order.channels)
    (void)changed.of(channel);  // throws if there is no such
  const double true_rate_Hz = instrument_->plan_rate(at_rest_rate_Hz).rate_Hz;
  const auto source = make_source(*clock_, *instrument_);
  const auto series = sample_at_rest(*clock_, *controller_, *source, instrument_->channels(), true_rate_Hz,
                                     order.seconds, [this] { return asked_to_stop(); });
  if (asked_to_stop()) throw HardwareError("rig", "the measurement was stopped", "Nothing was changed.");
  CalibrationReport report;
  for (size_t i = 0; i < series.size(); ++i) {
    const ChannelConfig& channel = rig_.daq.channels[i];
    if (!asks_for(order, channel.name)) continue;
    const auto expected = static_cast<size_t>(true_rate_Hz * order.seconds);
    const AtRest reading = series[i].size() < 3 ? AtRest{} : at_rest(series[i], true_rate_Hz);
    if (const std::string objection = objection_to(reading, channel.kPa_per_V, expected);
        !objection.empty()) {
      throw HardwareError(
          "channel " + channel.name, objection,
          "Nothing was changed. Let the rig come to rest, look at transducer, tap and cable, and try again.");
    }
    const CalibrationPoint point{reading.mean_V, order.kPa.value_or(0), utc_now(), order.operator_name};
    order.kPa ? changed.add_point(channel.name, point) : changed.set_zero(channel.name, point);
    report.channels.push_back({channel.name, reading.samples, reading.mean_V,
                               std::abs(channel.kPa_per_V) * reading.sd_V,
                               channel.kPa_per_V * reading.drift_V, changed.of(channel.name).points.size()});
  }
  changed.save();
  book_ = std::move(changed);
  rig_.daq.channels = book_.channels();
  for (ChannelReading& reading : report.channels) {
    const auto channel = std::ranges::find(rig_.daq.channels, reading.name, &ChannelConfig::name);
    reading.kPa_per_V = channel->kPa_per_V;
    reading.zero_V = channel->zero_V;
  }
  report.file = book_.file().string();
  return report;
}

}  // namespace diastole
