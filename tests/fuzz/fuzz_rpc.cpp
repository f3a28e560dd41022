// Arbitrary lines against both ends of the daemon's socket. At the daemon's, clients' requests go through the methods to a rig that needs
// no devices: each has one answer, a line of JSON, and is carried out or refused by an error of ours (never as an internal one). At the
// client's, an answer is taken, or refused with an error of ours.
//
//   input: lines. One that begins with 01 comes from a console, with 02 from a user at the socket who may not control, any other from one
//          who may.

#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string_view>

#include "host/rpc/rpc_session.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/rig_on_paper.hpp"

namespace {

using namespace diastole;

void must(bool holds) {
  if (!holds) std::abort();
}

class Client final : public RpcSession {
 public:
  Client(std::shared_ptr<RpcState> rpc_state, Peer peer)
      : RpcSession(std::move(rpc_state), std::move(peer), SessionBounds::socket_requests) {}

  void ask(std::string_view request) {
    answers_ = 0;
    answer(request);
    rpc_state().context.restart();
    rpc_state().context.poll();
    must(answers_ == 1 && pending() == 0);
  }
  void close() override {}

 private:
  [[nodiscard]] bool is_open() const override { return true; }
  void write(const std::string& message) override {
    must(message.find('\n') == message.size() - 1);
    const nlohmann::json answer = nlohmann::json::parse(message, nullptr, false);
    must(answer.is_object() && answer.contains("result") != answer.contains("error"));
    if (answer.contains("error"))
      must(answer["error"]["code"] != static_cast<int>(rpc::Code::internal_error));
    ++answers_;
    written();
  }
  void take_more() override {}

  int answers_ = 0;
};

void serve(std::string_view lines) {
  static const RigConfig config = read_rig(std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples/rig.toml");
  static const ControlPolicy policy("", "");
  static boost::asio::io_context context;
  RigOnPaper rig(config);
  const auto state = std::make_shared<RpcState>(RpcState{context, rig, policy});
  const std::array clients{
      std::make_shared<Client>(state, Peer{.uid = ::geteuid(), .pid = 1, .groups = {}, .user = "operator"}),
      std::make_shared<Client>(
          state, Peer{.groups = {}, .user = "", .console = "127.0.0.1", .role = ConsoleRole::control}),
      std::make_shared<Client>(state, Peer{.pid = 2, .groups = {}, .user = "observer"})};
  while (!lines.empty()) {
    const std::string_view line = lines.substr(0, lines.find('\n'));
    lines.remove_prefix(std::min(lines.size(), line.size() + 1));
    const size_t who = line.starts_with('\1') ? 1 : line.starts_with('\2') ? 2 : 0;
    clients.at(who)->ask(line.substr(who > 0 ? 1 : 0));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  serve(text);
  try {
    (void)rpc::parse_answer(text, 1);
  } catch (const rpc::Error&) {
  } catch (const InputError&) {
  } catch (const HardwareError&) {
  }
  return 0;
}
