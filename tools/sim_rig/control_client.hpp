#pragma once
// The other end of a rig's control socket (server.hpp): what `sim_rig ctl` and `diastole replay` use.

#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <chrono>
#include <optional>
#include <string>

#include "host/transport/descriptor.hpp"
#include "host/transport/unix_socket.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::sim_rig {

class ControlClient {
 public:
  /// Throws HardwareError when no rig listens there.
  explicit ControlClient(const std::string& socket)
      : path_(socket),
        socket_(connect_unix_socket(socket, "Start one with sim_rig --control " + socket + ".")) {}

  /// One order, one answer, without its "ok ". Throws InputError with what the rig refuses, HardwareError when it has
  /// gone or does not answer.
  std::string order(const std::string& text) {
    const std::string sent = text + '\n';
    if (::send(socket_.get(), sent.data(), sent.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(sent.size())) {
      throw HardwareError(path_, "the simulated rig has gone", "Start it again.");
    }
    while (const auto answer = line(answer_timeout)) {
      if (answer->starts_with("held ")) {
        held_ = answer->substr(5);
      } else if (answer->starts_with("ok")) {
        return answer->size() > 3 ? answer->substr(3) : "";
      } else {
        throw InputError({path_, "", answer->starts_with("error ") ? answer->substr(6) : *answer, ""});
      }
    }
    throw HardwareError(path_, "the simulated rig does not answer", "Start it again.");
  }
  /// The moment for which a hold was ordered, if it has come.
  std::optional<std::string> held() {
    if (!held_) {
      if (const auto said = line(std::chrono::milliseconds(0)); said && said->starts_with("held "))
        held_ = said->substr(5);
    }
    return std::exchange(held_, std::nullopt);
  }

 private:
  static constexpr std::chrono::milliseconds answer_timeout{10'000};

  /// The next whole line, if it comes in time.
  std::optional<std::string> line(std::chrono::milliseconds timeout) {
    const auto give_up = std::chrono::steady_clock::now() + timeout;
    while (true) {
      if (const size_t end = inbox_.find('\n'); end != std::string::npos) {
        std::string found = inbox_.substr(0, end);
        inbox_.erase(0, end + 1);
        return found;
      }
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(give_up - std::chrono::steady_clock::now());
      pollfd readable{socket_.get(), POLLIN, 0};
      if (::poll(&readable, 1, std::max(0, static_cast<int>(left.count()))) <= 0) return std::nullopt;
      std::array<char, 1024> block{};
      const ssize_t got = ::recv(socket_.get(), block.data(), block.size(), 0);
      if (got <= 0) return std::nullopt;
      inbox_.append(block.data(), static_cast<size_t>(got));
    }
  }

  std::string path_;
  Descriptor socket_;
  std::string inbox_;
  std::optional<std::string> held_;
};

}  // namespace diastole::sim_rig
