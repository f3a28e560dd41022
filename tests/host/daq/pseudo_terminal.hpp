#pragma once
// Pseudo-terminals in place of serial lines: one whose far end is code, and two joined to a cable.

#include <chrono>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "host/transport/descriptor.hpp"

namespace diastole {

class PseudoTerminal {
 public:
  PseudoTerminal();

  /// What a program opens: "/dev/pts/7".
  [[nodiscard]] const std::string& path() const { return path_; }
  /// What arrived within the time; empty if nothing did.
  [[nodiscard]] std::vector<uint8_t> receive(std::chrono::milliseconds timeout) const;
  void send(std::span<const uint8_t> bytes) const;

 private:
  Descriptor far_, near_;  // near_: kept open, so that far_ sees no hang-up between two users
  std::string path_;
};

/// A cable between two serial ports of this machine.
class NullModem {
 public:
  NullModem();
  [[nodiscard]] const std::string& left() const { return left_.path(); }
  [[nodiscard]] const std::string& right() const { return right_.path(); }

 private:
  PseudoTerminal left_, right_;
  std::jthread forth_, back_;
};

}  // namespace diastole
