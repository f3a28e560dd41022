#pragma once
// Where a running rig takes orders: a unix stream socket, text lines, one answer line ("ok ..." or "error ...") to
// each. What the orders are, the owner knows.

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tools/sim_rig/listening_socket.hpp"

namespace diastole::sim_rig {

class ControlServer {
 public:
  using ClientId = int;
  /// Answers an order.
  using Obey = std::function<std::string(ClientId, const std::string& order)>;

  /// Listens at `path` (a stale socket there is replaced). Throws HardwareError when it cannot.
  explicit ControlServer(std::filesystem::path path)
      : path_(std::move(path)), listener_(listen_at(path_, "--control")) {}
  ~ControlServer() {
    for (const Client& client : clients_)
      ::close(client.id);
    ::close(listener_);
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;

  /// To wait for: the listening socket and all clients.
  [[nodiscard]] std::vector<int> descriptors() const {
    std::vector<int> list{listener_};
    for (const Client& client : clients_)
      list.push_back(client.id);
    return list;
  }
  /// Takes what has come. Never waits.
  void service(const Obey& obey) {
    accept_clients();
    for (size_t i = 0; i < clients_.size();) {
      const bool alive = receive_from(clients_[i]);
      const ClientId id = clients_[i].id;
      for (size_t end = 0; (end = clients_[i].inbox.find('\n')) != std::string::npos;) {
        const std::string order = clients_[i].inbox.substr(0, end);
        clients_[i].inbox.erase(0, end + 1);
        send(id, obey(id, order));
      }
      if (alive && clients_[i].inbox.size() < longest_order) {
        ++i;
        continue;
      }
      ::close(id);
      clients_.erase(clients_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  /// Something that a client did not ask for.
  void send(ClientId client, const std::string& line) {
    const std::string text = line + '\n';
    (void)::send(client, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }
  [[nodiscard]] bool connected(ClientId client) const {
    return std::ranges::find(clients_, client, &Client::id) != clients_.end();
  }

 private:
  static constexpr size_t longest_order = 4096;

  struct Client {
    ClientId id;
    std::string inbox;
  };
  void accept_clients() {
    while (true) {
      const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
      if (client < 0) return;
      clients_.push_back({client, {}});
    }
  }
  /// False when it has gone.
  bool receive_from(Client& client) {
    std::array<char, 1024> block{};
    while (client.inbox.size() < longest_order) {
      const ssize_t got = ::read(client.id, block.data(), block.size());
      if (got == 0) return false;
      if (got < 0) return errno == EAGAIN || errno == EINTR;
      client.inbox.append(block.data(), static_cast<size_t>(got));
    }
    return true;
  }

  std::filesystem::path path_;
  int listener_ = -1;
  std::vector<Client> clients_;
};

}  // namespace diastole::sim_rig
