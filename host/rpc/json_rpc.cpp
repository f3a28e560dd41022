#include "host/rpc/json_rpc.hpp"

#include "host/rig/rig_answers.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole::rpc {
namespace {

using nlohmann::json;

std::string line_of(const json& message) { return json_text(message) + "\n"; }

/// Discarded if it is no JSON.
json parsed(std::string_view line) {
  try {
    return json::parse(line, no_deeper_than<json>(most_depth), false);
  } catch (const JsonTooDeep&) {
    throw Error(Code::parse_error, "this line is nested too deeply");
  }
}

json error_object(Code code, const std::string& message, const json& data) {
  json error{{"code", static_cast<int>(code)}, {"message", message}};
  if (!data.is_null()) error["data"] = data;
  return error;
}

json describe(const std::exception_ptr& error) {
  try {
    std::rethrow_exception(error);
  } catch (const Error& e) {
    return error_object(e.code, e.what(), e.data);
  } catch (const InputError& e) {
    const InputFault& fault = e.fault();
    return error_object(
        Code::input_fault, e.what(),
        {{"file", fault.file}, {"place", fault.place}, {"problem", fault.problem}, {"remedy", fault.remedy}});
  } catch (const HardwareError& e) {
    return error_object(Code::hardware_fault, e.what(), nullptr);
  } catch (const RigBusy& e) {
    return error_object(Code::busy, e.what(), nullptr);
  } catch (const json::exception& e) {
    return error_object(Code::invalid_params, e.what(), nullptr);
  } catch (const std::exception& e) {
    return error_object(Code::internal_error, e.what(), nullptr);
  }
}

/// HardwareError prints itself as "DEVICE: PROBLEM\n  REMEDY".
HardwareError hardware_error_from(const std::string& text) {
  const size_t colon = text.find(": ");
  const size_t remedy = text.find("\n  ");
  if (colon == std::string::npos || remedy == std::string::npos || remedy < colon) return {text, "", ""};
  return {text.substr(0, colon), text.substr(colon + 2, remedy - colon - 2), text.substr(remedy + 3)};
}

Code code_of(const json& error) {
  const json code = error.value("code", json());
  return code.is_number_integer() ? static_cast<Code>(code.get<int>()) : Code::internal_error;
}

[[noreturn]] void raise(const json& error) {
  const Code code = code_of(error);
  const std::string message = error.value("message", "");
  const json data = error.value("data", json());
  if (code == Code::input_fault && data.is_object()) {
    throw InputError({data.value("file", ""), data.value("place", ""), data.value("problem", ""),
                      data.value("remedy", "")});
  }
  if (code == Code::hardware_fault) throw hardware_error_from(message);
  throw Error(code, message, data);
}

}  // namespace

Request parse_request(std::string_view line, json& id) {
  const json message = parsed(line);
  if (message.is_discarded()) throw Error(Code::parse_error, "this line is not JSON");
  if (!message.is_object()) throw Error(Code::invalid_request, "a request is one JSON object");
  if (message.contains("id") && (message["id"].is_string() || message["id"].is_number_integer())) {
    id = message["id"];
  }
  if (message.value("jsonrpc", json()) != "2.0") {
    throw Error(Code::invalid_request, "jsonrpc must be \"2.0\"");
  }
  if (id.is_null()) throw Error(Code::invalid_request, "a request needs an id (a text or a whole number)");
  const json method = message.value("method", json());
  if (!method.is_string()) throw Error(Code::invalid_request, "method must be a text");
  Request request{id, method.get<std::string>()};
  if (message.contains("params")) {
    if (!message["params"].is_object()) throw Error(Code::invalid_params, "params must be an object");
    request.params = message["params"];
  }
  return request;
}

std::string result_line(const json& id, const json& result) {
  return line_of({{"jsonrpc", "2.0"}, {"id", id}, {"result", result}});
}

std::string error_line(const json& id, const std::exception_ptr& error) {
  return line_of({{"jsonrpc", "2.0"}, {"id", id}, {"error", describe(error)}});
}

std::string request_line(int64_t id, const std::string& method, const json& params) {
  return line_of({{"jsonrpc", "2.0"}, {"id", id}, {"method", method}, {"params", params}});
}

json parse_answer(std::string_view line, int64_t id) {
  const json message = parsed(line);
  if (!message.is_object()) throw Error(Code::parse_error, "the daemon's answer is not a JSON object");
  if (message.contains("error") && message["error"].is_object()) {
    try {
      raise(message["error"]);
    } catch (const json::exception&) {
      throw Error(Code::invalid_request, "the daemon's answer is an error of unknown form");
    }
  }
  if (message.value("id", json()) != json(id) || !message.contains("result")) {
    throw Error(Code::invalid_request, "the daemon's answer does not belong to the request");
  }
  return message["result"];
}

}  // namespace diastole::rpc
