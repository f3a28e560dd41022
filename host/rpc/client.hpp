#pragma once
// The daemon from outside: what the commands `run`, `status`, `stop`, `home` use.

#include <fmt/format.h>
#include <poll.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <nlohmann/json.hpp>
#include <string>

#include "host/rpc/json_rpc.hpp"
#include "host/rpc/peer.hpp"
#include "host/transport/descriptor.hpp"
#include "host/transport/unix_socket.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {

class DaemonClient {
 public:
  /// Connects. Throws HardwareError if no daemon listens there, or one that may not serve this user (peer.hpp).
  explicit DaemonClient(const std::string& socket) : path_(socket), socket_(connect_unix_socket(socket)) {
    expect_daemon(socket_.get(), socket);
  }

  /// One request, one answer. Throws InputError or HardwareError as the daemon raised it, HardwareError if
  /// the daemon is gone, silent for longer than `timeout`, or refuses.
  nlohmann::json call(const std::string& method, const nlohmann::json& params = nlohmann::json::object(),
                      std::chrono::seconds timeout = std::chrono::seconds(30)) {
    const int64_t id = next_id_++;
    const std::string line = rpc::request_line(id, method, params);
    for (size_t sent = 0; sent < line.size();) {
      const ssize_t count = ::send(socket_.get(), line.data() + sent, line.size() - sent, MSG_NOSIGNAL);
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) throw HardwareError(path_, "the daemon has gone", "See its log, and start it again.");
      sent += static_cast<size_t>(count);
    }
    try {
      return rpc::parse_answer(read_line(timeout), id);
    } catch (const rpc::Error& error) {
      throw HardwareError("daemon at " + path_, error.what(),
                          "`diastole status` says what the rig is doing.");
    }
  }

 private:
  std::string read_line(std::chrono::seconds timeout) {
    const auto end = std::chrono::steady_clock::now() + timeout;
    std::array<char, 65536> block{};
    for (size_t newline = inbox_.find('\n');; newline = inbox_.find('\n')) {
      if (newline != std::string::npos) {
        std::string line = inbox_.substr(0, newline);
        inbox_.erase(0, newline + 1);
        return line;
      }
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
      pollfd state{socket_.get(), POLLIN, 0};
      const int ready = left.count() > 0 ? ::poll(&state, 1, static_cast<int>(left.count())) : 0;
      if (ready < 0 && errno == EINTR) continue;
      if (ready == 0) {
        throw HardwareError("daemon at " + path_, fmt::format("has not answered for {} s", timeout.count()),
                            "See its log; restart it if it hangs.");
      }
      const ssize_t count = ::read(socket_.get(), block.data(), block.size());
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) throw HardwareError(path_, "the daemon has gone", "See its log, and start it again.");
      inbox_.append(block.data(), static_cast<size_t>(count));
    }
  }

  std::string path_;
  Descriptor socket_;
  std::string inbox_;
  int64_t next_id_ = 1;
};

}  // namespace diastole
