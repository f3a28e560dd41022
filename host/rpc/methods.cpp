#include "host/rpc/methods.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "host/rpc/json_rpc.hpp"
#include "host/rpc/rig_json.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/plain_text.hpp"
#include "protocol/runfile/layout.hpp"

namespace diastole {
namespace {

using nlohmann::json;

constexpr size_t most_experiment_bytes = 256U << 10;
constexpr size_t most_fact_bytes = 4096;

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

/// Passes the rig's answer on as JSON.
RigDone to(Reply reply) {
  return [reply = std::move(reply)](const std::exception_ptr& error, const RigAnswer& answer) {
    reply(error, error ? json() : as_json(answer));
  };
}

void rig_jog(Rig& rig, const json& params, const Reply& reply) {
  rig.jog(number_in(params, "mL"), number_in(params, "rate_mL_s"), to(reply));
}
void rig_write_settings(Rig& rig, const json& params, const Reply& reply) {
  rig.write_settings({params.value("defaults", false), settings_in(params.value("set", json::object()))},
                     to(reply));
}

void rig_self_test(Rig& rig, const json& params, const Reply& reply) {
  const double seconds = params.contains("seconds") ? number_in(params, "seconds") : 10;
  if (!(seconds >= 2 && seconds <= 600))
    throw rpc::Error(rpc::Code::invalid_params, "seconds must be 2 to 600");
  rig.self_test(seconds, to(reply));
}

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

void rig_calibrate(Rig& rig, const json& params, const Reply& reply) {
  CalibrationOrder order = measurement_in(params);
  order.kPa = number_in(params, "kPa");
  if (order.channels.size() != 1)
    throw rpc::Error(rpc::Code::invalid_params, "channels must name one channel");
  rig.calibrate(std::move(order), to(reply));
}

std::string short_text(const json& value, const std::string& name) {
  if (!value.is_string() || value.get_ref<const std::string&>().size() > most_fact_bytes) {
    throw rpc::Error(rpc::Code::invalid_params,
                     fmt::format("session: {} must be a text of at most {} bytes", name, most_fact_bytes));
  }
  if (const std::string why = why_not_plain(value.get_ref<const std::string&>()); !why.empty())
    throw rpc::Error(rpc::Code::invalid_params, fmt::format("session: {} {}", name, why));
  return value;
}

/// "session": {"specimen": "gel-7", "operator": "...", "room_temperature_C": 21.5, "notes": ["..."]}
runfile::Session session_in(const json& params) {
  runfile::Session session;
  const auto object = params.find("session");
  if (object == params.end()) return session;
  for (const auto& [name, value] : object->items()) {
    if (name == runfile::specimen_fact || name == runfile::operator_fact) {
      session.facts[name] = short_text(value, name);
    } else if (name == runfile::room_temperature_fact) {
      session.facts[name] = number_in(*object, runfile::room_temperature_fact);
    } else if (name == "notes") {
      for (const json& note : value)
        session.notes.push_back({"", "", short_text(note, "a note")});
    } else {
      throw rpc::Error(rpc::Code::invalid_params, "session: nothing is known of \"" + name + "\"");
    }
  }
  return session;
}

void run_start(Rig& rig, const json& params, const Reply& reply) {
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
                 params.value("prompts_answered", false), params.value("resume", false), session_in(params)},
                to(reply));
}

void run_trace(Rig& rig, const json& params, const Reply& reply) {
  reply(nullptr, as_json(rig.live().since(params.value("run_id", ""), whole_in(params, "first_row"),
                                          whole_in(params, "first_trigger"))));
}

void run_stop(Rig& rig, const json& params, const Reply& reply) {
  const std::string how = params.value("how", "now");
  if (how != "now" && how != "cycle_end" && how != "halt") {
    throw rpc::Error(rpc::Code::invalid_params, "how must be \"cycle_end\", \"now\" or \"halt\"");
  }
  const StopRequest request = how == "halt"  ? StopRequest::halt
                              : how == "now" ? StopRequest::now
                                             : StopRequest::at_cycle_end;
  reply(nullptr, {{"stopping", rig.stop(request)}});
}

/// Anybody's: it moves nothing, it only says which cycles are imaged, and the operator may sit at another terminal.
void run_continue(Rig& rig, const json& params, const Reply& reply) {
  std::optional<size_t> slice;
  if (params.contains("slice")) slice = whole_in(params, "slice");
  reply(nullptr, as_json(rig.run().go_on(slice)));
}

/// An order or a question that needs nothing but its name.
template <void (Rig::*ask)(Rig::Done)>
void plain(Rig& rig, const json&, const Reply& reply) {
  (rig.*ask)(to(reply));
}

constexpr std::array all_methods{
    Method{"rig.status", Access::anybody, plain<&Rig::status>},
    Method{"rig.home", Access::controller, plain<&Rig::home>},
    Method{"rig.zero", Access::controller,
           [](Rig& rig, const json& params, const Reply& reply) {
             rig.calibrate(measurement_in(params), to(reply));
           }},
    Method{"rig.calibrate", Access::controller, rig_calibrate},
    Method{"rig.clear_fault", Access::controller, plain<&Rig::clear_fault>},
    Method{"rig.jog", Access::controller, rig_jog},
    Method{"rig.settings", Access::anybody, plain<&Rig::settings>},
    Method{"rig.write_settings", Access::controller, rig_write_settings},
    Method{"rig.self_test", Access::controller, rig_self_test},
    Method{"rig.black_box", Access::anybody, plain<&Rig::black_box>},
    Method{"run.start", Access::controller, run_start},
    Method{"run.progress", Access::anybody,
           [](Rig& rig, const json& params, const Reply& reply) {
             reply(nullptr, as_json(rig.run().state(whole_in(params, "first_remark"))));
           }},
    Method{"run.trace", Access::anybody, run_trace},
    Method{"run.continue", Access::anybody, run_continue},
    Method{"run.stop", Access::anybody, run_stop},
};

}  // namespace

std::span<const Method> methods() { return all_methods; }

const Method* find_method(std::string_view name) {
  const auto* found = std::find_if(all_methods.begin(), all_methods.end(),
                                   [&](const Method& each) { return each.name == name; });
  return found == all_methods.end() ? nullptr : found;
}

}  // namespace diastole
