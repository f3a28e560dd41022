// Arbitrary lines against both ends of the daemon's socket: a request is taken or refused with rpc::Error, an
// answer taken or refused with an error of ours, and what is sent back is one line of JSON.

#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string_view>

#include "host/rpc/json_rpc.hpp"
#include "protocol/contract/input_error.hpp"

namespace {

using namespace diastole;

void must_be_one_line(const std::string& line) {
  if (line.find('\n') != line.size() - 1 || nlohmann::json::parse(line, nullptr, false).is_discarded())
    std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view line(reinterpret_cast<const char*>(data), size);
  nlohmann::json id;
  try {
    const rpc::Request request = rpc::parse_request(line, id);
    if (!request.params.is_object()) std::abort();
    must_be_one_line(rpc::result_line(request.id, request.params));
  } catch (const rpc::Error&) {
    must_be_one_line(rpc::error_line(id, std::current_exception()));
  }
  try {
    (void)rpc::parse_answer(line, 1);
  } catch (const rpc::Error&) {
  } catch (const InputError&) {
  } catch (const HardwareError&) {
  }
  return 0;
}
