#include "tests/faults/hostile_clients.hpp"

#include <fcntl.h>

#include <array>
#include <chrono>
#include <random>

#include "host/transport/unix_socket.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::faults {
namespace {

using Clock = std::chrono::steady_clock;

std::string message(std::mt19937& random) {
  switch (random() % 8) {
    case 0:
      return "\n";
    case 1:
      return "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"rig.home\"}\n";
    case 2:
      return "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"control.take\",\"params\":{}}\n";
    case 3:
      return "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"control.take\",\"params\":{\"take_over\":\"me\"}}\n";
    case 4:
      return "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"rig.status\"}\n";
    case 5:
      return std::string(random() % 200, '[') + "\n";
    case 6:
      return "{\"jsonrpc\":\"2.0\",\"id\":[],\"method\":7}\n";
    default: {
      std::string noise(random() % 100, '\0');
      for (char& each : noise)
        each = static_cast<char>(random());
      return noise + "\n";
    }
  }
}

}  // namespace

HostileClients::HostileClients(std::string socket, int clients, double messages_a_second)
    : socket_(std::move(socket)) {
  for (int i = 0; i < clients; ++i)
    threads_.emplace_back([this, i, clients, messages_a_second] {
      attack(static_cast<unsigned>(i) + 1, messages_a_second / clients);
    });
}

HostileClients::~HostileClients() { ended_ = true; }

void HostileClients::attack(unsigned seed, double messages_a_second) {
  std::mt19937 random(seed);
  const auto begun = Clock::now();
  std::array<char, 65536> answers{};
  for (uint64_t own = 0; !ended_;) {
    try {
      const Descriptor connection = connect_unix_socket(socket_);
      ::fcntl(connection.get(), F_SETFL, O_NONBLOCK);
      const bool reads = random() % 4 != 0;
      for (uint64_t left = random() % 2000; left > 0 && !ended_; --left) {
        const std::string text = random() % 500 == 0 ? std::string(300'000, 'x') : message(random);
        if (::send(connection.get(), text.data(), text.size(), MSG_NOSIGNAL) < 0 && errno != EAGAIN) break;
        ++sent_;
        const ssize_t got = reads ? ::recv(connection.get(), answers.data(), answers.size(), 0) : 0;
        const std::string_view received(answers.data(), static_cast<size_t>(got > 0 ? got : 0));
        if (received.find("\"result\":{\"own\":true") != std::string_view::npos) ++granted_;
        std::this_thread::sleep_until(
            begun + std::chrono::duration_cast<Clock::duration>(
                        std::chrono::duration<double>(static_cast<double>(++own) / messages_a_second)));
      }
    } catch (const HardwareError&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
}

}  // namespace diastole::faults
