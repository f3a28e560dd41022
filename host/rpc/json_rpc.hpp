#pragma once
// JSON-RPC 2.0 (jsonrpc.org/specification) on lines: each message is one line of UTF-8 JSON, ended by '\n',
// at most most_line_bytes long and most_depth levels deep. Only single requests with an id are answered; batches and
// notifications are refused.

#include <exception>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace diastole::rpc {

inline constexpr size_t most_line_bytes = 1U << 20;
inline constexpr int most_depth = 32;

/// Error codes: those of the specification, then ours.
enum class Code : int {
  parse_error = -32700,
  invalid_request = -32600,
  method_not_found = -32601,
  invalid_params = -32602,
  internal_error = -32603,
  input_fault = -32001,     ///< data: {file, place, problem, remedy}, as InputError
  hardware_fault = -32002,  ///< message as HardwareError prints itself
  control_held = -32003,    ///< another client holds the rig; data: {holder}
  busy = -32004,            ///< a run or homing is going on
  not_allowed = -32005,     ///< this user may observe and stop, nothing else
};

class Error : public std::runtime_error {
 public:
  Error(Code error_code, const std::string& message, nlohmann::json details = nullptr)
      : std::runtime_error(message), code(error_code), data(std::move(details)) {}
  Code code;
  nlohmann::json data;
};

struct Request {
  nlohmann::json id;
  std::string method;
  nlohmann::json params = nlohmann::json::object();  ///< always an object
};

/// Throws Error. `id` is set as soon as it is known, so that the answer can carry it.
Request parse_request(std::string_view line, nlohmann::json& id);

/// Lines to send, '\n' included. Texts that are not UTF-8 have their wrong bytes replaced.
std::string result_line(const nlohmann::json& id, const nlohmann::json& result);
std::string error_line(const nlohmann::json& id, const std::exception_ptr& error);
std::string request_line(int64_t id, const std::string& method, const nlohmann::json& params);

/// The result in an answer to request `id`. Throws InputError or HardwareError if the answer carries one,
/// else Error.
nlohmann::json parse_answer(std::string_view line, int64_t id);

}  // namespace diastole::rpc
