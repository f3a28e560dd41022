#pragma once
// Clients that mean no good: each thread writes malformed, half, huge and forbidden messages, reconnects at
// random, and reads or does not read what comes.

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

namespace diastole::faults {

class HostileClients {
 public:
  /// Together they send `messages_a_second` at most.
  HostileClients(std::string socket, int clients, double messages_a_second);
  ~HostileClients();
  HostileClients(const HostileClients&) = delete;
  HostileClients& operator=(const HostileClients&) = delete;

  [[nodiscard]] uint64_t sent() const { return sent_; }
  /// How many were granted the control of the rig.
  [[nodiscard]] uint64_t granted() const { return granted_; }

 private:
  void attack(unsigned seed, double messages_a_second);

  std::string socket_;
  std::atomic<uint64_t> sent_ = 0;
  std::atomic<uint64_t> granted_ = 0;
  std::atomic<bool> ended_ = false;
  std::vector<std::jthread> threads_;
};

}  // namespace diastole::faults
