#pragma once
// The orders that wait for the rig's thread, what occupies the rig, and the stop that was asked for. Of any thread.

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "host/rig/rig_answers.hpp"
#include "host/transport/real_time.hpp"

namespace diastole {

struct RigOrder {
  std::string activity;                           ///< empty: does not occupy the rig
  std::function<std::optional<RigAnswer>()> act;  ///< no answer: it has called `done` itself
  RigDone done;
};

class OrderQueue {
 public:
  /// Occupies the rig with the order's activity. Throws RigBusy while another does, HardwareError after end().
  void give(RigOrder order);
  [[nodiscard]] std::optional<RigOrder> next();
  /// Returns when there is an order, or after a while.
  void wait(const std::stop_token& stop, std::chrono::milliseconds most);
  void wake() { wake_.notify_all(); }

  /// What occupies the rig; empty: nothing.
  [[nodiscard]] std::string activity() const;
  /// Throws RigBusy if anything does.
  void require_free() const;
  /// Goes over to another activity, `with` carried out at the same moment; false, and nothing changes, if a stop was
  /// asked for before.
  bool begin(const std::string& activity, const std::function<void()>& with);
  void change(const std::string& activity);
  /// The rig is free again, `with` carried out at the same moment.
  void leave(const std::function<void()>& with = [] {});

  /// Stops what moves or is about to; without anything, `false`.
  bool stop(StopRequest how);
  [[nodiscard]] StopRequest stop_asked() const;
  /// Stops now and takes no more orders.
  void end();
  /// True when nothing is going on or waiting.
  [[nodiscard]] bool idle() const;

 private:
  mutable InheritingMutex mutex_;  // the server's thread, which has no priority, holds it too
  std::condition_variable_any wake_;
  std::deque<RigOrder> orders_;
  std::string activity_;
  bool ending_ = false;
  StopRequest stop_request_ = StopRequest::none;
};

}  // namespace diastole
