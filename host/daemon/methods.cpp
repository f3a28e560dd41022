#include "host/daemon/methods.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "host/daemon/json_rpc.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

using nlohmann::json;
using Done = RigService::Done;

constexpr size_t most_experiment_bytes = 256U << 10;

/// A count in `params`, 0 without it. Of others the conversion to an unsigned integer is not defined.
uint64_t whole_in(const json& params, const char* name) {
  const auto found = params.find(name);
  if (found == params.end()) return 0;
  if (!found->is_number_unsigned()) {
    throw rpc::Error(rpc::Code::invalid_params, fmt::format("{} must be a whole number from 0", name));
  }
  return found->get<uint64_t>();
}

double number_in(const json& params, const char* name) {
  const auto found = params.find(name);
  if (found == params.end() || !found->is_number() || !std::isfinite(found->get<double>())) {
    throw rpc::Error(rpc::Code::invalid_params, fmt::format("{} must be a number", name));
  }
  return found->get<double>();
}

void rig_status(RigService& rig, const json&, Done done) { rig.status(std::move(done)); }
void rig_home(RigService& rig, const json&, Done done) { rig.home(std::move(done)); }
void rig_clear_fault(RigService& rig, const json&, Done done) { rig.clear_fault(std::move(done)); }

void rig_jog(RigService& rig, const json& params, Done done) {
  rig.jog(number_in(params, "mL"), number_in(params, "rate_mL_s"), std::move(done));
}
void rig_settings(RigService& rig, const json&, Done done) { rig.settings(std::move(done)); }
void rig_write_settings(RigService& rig, const json& params, Done done) {
  rig.write_settings({params.value("defaults", false), params.value("set", json::object())}, std::move(done));
}
void rig_black_box(RigService& rig, const json&, Done done) { rig.black_box(std::move(done)); }

CalibrationOrder measurement_in(const json& params) {
  CalibrationOrder order;
  order.channels = params.value("channels", std::vector<std::string>{});
  if (params.contains("seconds")) order.seconds = number_in(params, "seconds");
  order.operator_name = params.value("operator", "");
  if (!(order.seconds >= 1 && order.seconds <= 600)) {
    throw rpc::Error(rpc::Code::invalid_params, "seconds must be 1 to 600");
  }
  return order;
}

void rig_zero(RigService& rig, const json& params, Done done) {
  rig.calibrate(measurement_in(params), std::move(done));
}

void rig_calibrate(RigService& rig, const json& params, Done done) {
  CalibrationOrder order = measurement_in(params);
  order.kPa = number_in(params, "kPa");
  if (order.channels.size() != 1)
    throw rpc::Error(rpc::Code::invalid_params, "channels must name one channel");
  rig.calibrate(std::move(order), std::move(done));
}

void run_start(RigService& rig, const json& params, Done done) {
  const std::string text = params.at("experiment");
  if (text.size() > most_experiment_bytes) {
    throw rpc::Error(rpc::Code::invalid_params, "the experiment is too long");
  }
  const json points = params.value("points", json::object());
  const auto read_points = [&](const std::string& name) -> std::string {
    if (const auto found = points.find(name); found != points.end()) return *found;
    throw InputError({name, "", "was not sent with the experiment", "Send its text in `points`."});
  };
  rig.start_run({parse_experiment(text, params.value("file", "experiment"), read_points),
                 params.value("prompts_answered", false)},
                std::move(done));
}

void run_progress(RigService& rig, const json& params, const Done& done) {
  done(nullptr, rig.run_progress(whole_in(params, "first_remark")));
}

/// To a tenth of a millisecond and of a pascal; null for NaN.
json rounded(double value) {
  if (std::isnan(value)) return nullptr;
  return std::round(1e4 * value) / 1e4;
}

void run_trace(RigService& rig, const json& params, const Done& done) {
  const LiveTrace::Excerpt excerpt = rig.live().since(
      params.value("run_id", ""), whole_in(params, "first_row"), whole_in(params, "first_trigger"));
  json time_s = json::array(), kPa = json::array(), filtered_kPa = json::array(), trigger_s = json::array();
  for (const LiveTrace::Row& each : excerpt.rows) {
    time_s.push_back(rounded(each.time_s));
    kPa.push_back(rounded(each.kPa));
    filtered_kPa.push_back(rounded(each.filtered_kPa));
  }
  for (const double each : excerpt.trigger_s)
    trigger_s.push_back(rounded(each));
  done(nullptr, {{"run_id", excerpt.run_id},
                 {"first_row", excerpt.first_row},
                 {"time_s", time_s},
                 {"kPa", kPa},
                 {"filtered_kPa", filtered_kPa},
                 {"first_trigger", excerpt.first_trigger},
                 {"trigger_s", trigger_s}});
}

void run_stop(RigService& rig, const json& params, const Done& done) {
  const std::string how = params.value("how", "now");
  if (how != "now" && how != "cycle_end" && how != "halt") {
    throw rpc::Error(rpc::Code::invalid_params, "how must be \"cycle_end\", \"now\" or \"halt\"");
  }
  const StopRequest request = how == "halt"  ? StopRequest::halt
                              : how == "now" ? StopRequest::now
                                             : StopRequest::at_cycle_end;
  done(nullptr, {{"stopping", rig.stop(request)}});
}

/// Anybody's: it moves nothing, it only tells which cycles are imaged, and the operator may sit at another terminal.
void run_continue(RigService& rig, const json& params, const Done& done) {
  std::optional<size_t> slice;
  if (params.contains("slice")) slice = whole_in(params, "slice");
  done(nullptr, rig.continue_run(slice));
}

constexpr std::array all_methods{
#define DIASTOLE_METHOD(name, access, function) \
  Method{name, Access::access,                  \
         [](RigService& rig, const json& params, Done done) { function(rig, params, std::move(done)); }},
#include "host/daemon/method_list.inc"
#undef DIASTOLE_METHOD
};

}  // namespace

std::span<const Method> methods() { return all_methods; }

const Method* find_method(std::string_view name) {
  const auto* found = std::find_if(all_methods.begin(), all_methods.end(),
                                   [&](const Method& each) { return each.name == name; });
  return found == all_methods.end() ? nullptr : found;
}

}  // namespace diastole
