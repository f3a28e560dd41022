#include "tools/sim_rig/control_server.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "tools/sim_rig/listening_socket.hpp"

namespace diastole::sim_rig {
namespace {

constexpr size_t longest_order = 4096;

}  // namespace

ControlServer::ControlServer(std::filesystem::path path)
    : path_(std::move(path)), listener_(listen_at(path_, "--control")) {}

ControlServer::~ControlServer() {
  for (const Client& client : clients_)
    ::close(client.id);
  ::close(listener_);
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

std::vector<int> ControlServer::descriptors() const {
  std::vector<int> list{listener_};
  for (const Client& client : clients_)
    list.push_back(client.id);
  return list;
}

bool ControlServer::connected(ClientId client) const {
  return std::ranges::find(clients_, client, &Client::id) != clients_.end();
}

void ControlServer::service(const Obey& obey) {
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

void ControlServer::send(ClientId client, const std::string& line) {
  const std::string text = line + '\n';
  (void)::send(client, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

void ControlServer::accept_clients() {
  while (true) {
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (client < 0) return;
    clients_.push_back({client, {}});
  }
}

bool ControlServer::receive_from(Client& client) {
  std::array<char, 1024> block{};
  while (client.inbox.size() < longest_order) {
    const ssize_t got = ::read(client.id, block.data(), block.size());
    if (got == 0) return false;
    if (got < 0) return errno == EAGAIN || errno == EINTR;
    client.inbox.append(block.data(), static_cast<size_t>(got));
  }
  return true;
}

}  // namespace diastole::sim_rig
