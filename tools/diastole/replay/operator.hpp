#pragma once
// Gives the daemon the recorded orders at their recorded time: the rig holds the conducted time there until the order
// has been given. In real time it is given when its time has come.

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <string>

#include "host/rpc/client.hpp"
#include "tools/diastole/replay/replay_plan.hpp"
#include "tools/sim_rig/control_client.hpp"

namespace diastole::replay {

class Operator {
 public:
  /// Orders all holds. Throws HardwareError when the rig does not answer.
  Operator(const std::string& control_socket, const std::string& daemon_socket,
           const std::vector<Order>& orders)
      : rig_(control_socket), daemon_socket_(daemon_socket), orders_(orders.begin(), orders.end()) {
    for (const Order& order : orders)
      rig_.order(fmt::format("hold run+{:.9f}s", std::max(order.time_s - earlier_s, 0.0)));
  }

  /// To be called often while the run lasts.
  void attend() {
    while (!orders_.empty() && rig_.held()) {
      give(orders_.front());
      orders_.pop_front();
      rig_.order("go");
    }
  }

 private:
  /// Clocks are mapped to some nanoseconds, and the daemon looks for orders once in a few milliseconds: a moment earlier
  /// is the same turn of its loop.
  static constexpr double earlier_s = 20e-6;

  void give(const Order& order) const {
    DaemonClient daemon(daemon_socket_);
    switch (order.kind) {
      case Order::Kind::go_on:
        daemon.call("run.continue", {{"slice", order.slice}});
        break;
      case Order::Kind::stop_at_cycle_end:
        daemon.call("run.stop", {{"how", "cycle_end"}});
        break;
      case Order::Kind::stop_now:
        daemon.call("run.stop", {{"how", "now"}});
        break;
      case Order::Kind::halt:
        daemon.call("run.stop", {{"how", "halt"}});
        break;
    }
  }

  sim_rig::ControlClient rig_;
  std::string daemon_socket_;
  std::deque<Order> orders_;
};

}  // namespace diastole::replay
