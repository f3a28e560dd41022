#include "host/web/console.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>

#include "host/rpc/acceptor.hpp"
#include "host/web/certificate.hpp"
#include "host/web/listen.hpp"
#include "host/web/server_state.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::web {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

std::string machine_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

void close_all(Connections& connections) {
  for (const auto& [number, connection] : std::exchange(connections, {}))
    connection->close();
}

}  // namespace

class ConsoleServer::Listener {
 public:
  Listener(std::shared_ptr<RpcState> rpc_state, const ConsoleAddress& address,
           const std::filesystem::path& certificate)
      : state_(std::make_shared<ServerState>(
            ServerState{std::move(rpc_state), AccessPolicy(address, machine_name()), std::nullopt})),
        acceptor_(std::make_shared<Acceptor<tcp>>(
            state_->rpc_state, "a browser",
            [state = state_](tcp::socket socket) { accept_connection(state, std::move(socket)); })) {
    listen_at(acceptor_->acceptor, {address.address, address.port}, "web console", "--console PORT");
    nlohmann::json& console = state_->rpc_state->console;
    if (state_->policy.reaches_beyond_this_machine()) encrypt(certificate);
    console["control"] = url(ConsoleRole::control);
    console["watch"] = url(ConsoleRole::watch);
  }

  void begin() { acceptor_->accept(); }

  void close() {
    acceptor_->close();
    close_all(state_->http_connections);
    close_all(state_->consoles);
    state_->rpc_state->console = nullptr;
  }

  [[nodiscard]] std::string url(ConsoleRole role) const {
    return state_->policy.url(role, acceptor_->acceptor.local_endpoint().port());
  }

 private:
  void encrypt(const std::filesystem::path& certificate) {
    using asio::ssl::context;
    const std::string fingerprint = certificate_fingerprint(certificate, machine_name());
    context& tls = state_->tls.emplace(context::tls_server);
    tls.set_options(context::default_workarounds | context::no_tlsv1 | context::no_tlsv1_1);
    try {
      tls.use_certificate_chain_file(certificate.string());
      tls.use_private_key_file(certificate.string(), context::pem);
    } catch (const boost::system::system_error& error) {
      throw HardwareError(certificate.string(), "cannot be used: " + error.code().message(),
                          "Remove it: another is made at the next start.");
    }
    state_->rpc_state->console["fingerprint"] = fingerprint;
    spdlog::info(
        "the console listens beyond this machine, encrypted; SHA-256 fingerprint of its certificate: {}",
        fingerprint);
  }

  std::shared_ptr<ServerState> state_;
  std::shared_ptr<Acceptor<tcp>> acceptor_;
};

ConsoleServer::ConsoleServer(std::shared_ptr<RpcState> rpc_state, const ConsoleAddress& address,
                             const std::filesystem::path& certificate)
    : listener_(std::make_shared<Listener>(std::move(rpc_state), address, certificate)) {
  listener_->begin();
}

ConsoleServer::~ConsoleServer() { listener_->close(); }

std::string ConsoleServer::url(ConsoleRole role) const { return listener_->url(role); }

}  // namespace diastole::web
