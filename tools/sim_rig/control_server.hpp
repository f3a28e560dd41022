#pragma once
// Where a running rig takes orders: a unix stream socket, text lines, one answer line ("ok ..." or "error ...") to
// each. What the orders are, the owner knows.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace diastole::sim_rig {

class ControlServer {
 public:
  using ClientId = int;
  /// Answers an order.
  using Obey = std::function<std::string(ClientId, const std::string& order)>;

  /// Listens at `path` (a stale socket there is replaced). Throws HardwareError when it cannot.
  explicit ControlServer(std::filesystem::path path);
  ~ControlServer();
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;

  /// To wait for: the listening socket and all clients.
  [[nodiscard]] std::vector<int> descriptors() const;
  /// Takes what has come. Never waits.
  void service(const Obey& obey);
  /// Something that a client did not ask for.
  void send(ClientId client, const std::string& line);
  [[nodiscard]] bool connected(ClientId client) const;

 private:
  struct Client {
    ClientId id;
    std::string inbox;
  };
  void accept_clients();
  /// False when it has gone.
  bool receive_from(Client& client);

  std::filesystem::path path_;
  int listener_ = -1;
  std::vector<Client> clients_;
};

}  // namespace diastole::sim_rig
