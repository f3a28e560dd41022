#pragma once
// Gives the daemon the recorded orders at their recorded time: the rig holds the conducted time there until the order
// has been given. In real time it is given when its time has come.

#include <deque>
#include <string>

#include "tools/diastole/replay/replay_plan.hpp"
#include "tools/sim_rig/control_client.hpp"

namespace diastole::replay {

class Operator {
 public:
  /// Orders all holds. Throws HardwareError when the rig does not answer.
  Operator(const std::string& control_socket, const std::string& daemon_socket,
           const std::vector<Order>& orders);

  /// To be called often while the run lasts.
  void attend();

 private:
  void give(const Order& order) const;

  sim_rig::ControlClient rig_;
  std::string daemon_socket_;
  std::deque<Order> orders_;
};

}  // namespace diastole::replay
