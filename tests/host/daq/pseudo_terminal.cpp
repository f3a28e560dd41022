#include "tests/host/daq/pseudo_terminal.hpp"

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <array>

namespace diastole {
namespace {

std::jthread carry(const PseudoTerminal& from, const PseudoTerminal& to) {
  return std::jthread([&from, &to](const std::stop_token& stop) {
    while (!stop.stop_requested())
      to.send(from.receive(std::chrono::milliseconds(20)));
  });
}

}  // namespace

PseudoTerminal::PseudoTerminal() {
  int far = -1;
  int near = -1;
  std::array<char, 128> name{};
  if (::openpty(&far, &near, name.data(), nullptr, nullptr) == 0) path_ = name.data();
  far_ = Descriptor(far);
  near_ = Descriptor(near);
  termios settings{};
  tcgetattr(near, &settings);
  cfmakeraw(&settings);
  tcsetattr(near, TCSANOW, &settings);
}

std::vector<uint8_t> PseudoTerminal::receive(std::chrono::milliseconds timeout) const {
  pollfd state{far_.get(), POLLIN, 0};
  if (::poll(&state, 1, static_cast<int>(timeout.count())) <= 0) return {};
  std::array<uint8_t, 512> block{};
  const ssize_t got = ::read(far_.get(), block.data(), block.size());
  return {block.begin(), block.begin() + std::max<ssize_t>(got, 0)};
}

void PseudoTerminal::send(std::span<const uint8_t> bytes) const {
  if (!bytes.empty()) (void)!::write(far_.get(), bytes.data(), bytes.size());
}

NullModem::NullModem() : forth_(carry(left_, right_)), back_(carry(right_, left_)) {}

}  // namespace diastole
