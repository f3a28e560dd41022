#include "host/web/console.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <chrono>

#include "host/web/hall.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::web {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

std::string machine_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

void close_all(Guests& guests) {
  for (const auto& [number, guest] : std::exchange(guests, {}))
    guest->close();
}

}  // namespace

class ConsoleServer::Listener : public std::enable_shared_from_this<Listener> {
 public:
  Listener(std::shared_ptr<Reception> reception, const ConsoleAddress& address)
      : hall_(std::make_shared<Hall>(Hall{std::move(reception), Door(address, machine_name())})),
        acceptor_(hall_->reception->context),
        pause_(hall_->reception->context) {
    const tcp::endpoint endpoint(address.address, address.port);
    try {
      acceptor_.open(endpoint.protocol());
      acceptor_.set_option(asio::socket_base::reuse_address(true));
      acceptor_.bind(endpoint);
      acceptor_.listen();
    } catch (const boost::system::system_error& error) {
      throw HardwareError("web console",
                          fmt::format("cannot listen at {}:{}: {}", address.address.to_string(), address.port,
                                      error.code().message()),
                          "Choose another port (--console PORT), or see who has this one (ss -ltnp).");
    }
    if (hall_->door.reaches_beyond_this_machine()) {
      spdlog::warn(
          "the console listens at {}, beyond this machine, and is not encrypted: whoever can read the "
          "network's traffic "
          "can read the token and control the rig. Safer: --console PORT here, and ssh -L "
          "PORT:127.0.0.1:PORT from "
          "the other machine",
          address.address.to_string());
    }
    hall_->reception->console = {{"control", url(ConsoleRole::control)}, {"watch", url(ConsoleRole::watch)}};
  }

  void begin() { accept(); }

  void close() {
    error_code ignored;
    acceptor_.close(ignored);
    pause_.cancel();
    close_all(hall_->visitors);
    close_all(hall_->consoles);
    hall_->reception->console = nullptr;
  }

  [[nodiscard]] std::string url(ConsoleRole role) const {
    return hall_->door.url(role, acceptor_.local_endpoint().port());
  }

 private:
  void accept() {
    acceptor_.async_accept([self = shared_from_this()](error_code error, tcp::socket socket) {
      if (error == asio::error::operation_aborted || !self->acceptor_.is_open()) return;
      if (error) return self->accept_later(error);
      receive_visitor(self->hall_, std::move(socket));
      self->accept();
    });
  }

  /// For want of descriptors or memory; those in use come back.
  void accept_later(error_code error) {
    hall_->reception->log.warn("a browser could not be accepted: " + error.message());
    pause_.expires_after(std::chrono::milliseconds(100));
    pause_.async_wait([self = shared_from_this()](error_code cancelled) {
      if (!cancelled) self->accept();
    });
  }

  std::shared_ptr<Hall> hall_;
  tcp::acceptor acceptor_;
  asio::steady_timer pause_;
};

ConsoleServer::ConsoleServer(std::shared_ptr<Reception> reception, const ConsoleAddress& address)
    : listener_(std::make_shared<Listener>(std::move(reception), address)) {
  listener_->begin();
}

ConsoleServer::~ConsoleServer() { listener_->close(); }

std::string ConsoleServer::url(ConsoleRole role) const { return listener_->url(role); }

}  // namespace diastole::web
