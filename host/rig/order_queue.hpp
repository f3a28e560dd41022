#pragma once
// The orders that wait for the rig's thread, what occupies the rig, and the stop that was asked for. Of any thread.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "host/rig/rig_answers.hpp"
#include "host/transport/real_time.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {

struct RigOrder {
  std::string activity;                           ///< empty: does not occupy the rig
  std::function<std::optional<RigAnswer>()> act;  ///< no answer: it has called `done` itself
  RigDone done;
};

class OrderQueue {
 public:
  /// Occupies the rig with the order's activity. Throws RigBusy while another does, HardwareError after end().
  void give(RigOrder order) {
    const std::lock_guard lock(mutex_);
    if (ending_) throw HardwareError("daemon", "is ending", "Start it again.");
    if (!order.activity.empty()) {
      require_none(activity_);
      activity_ = order.activity;
      stop_request_ = StopRequest::none;
    }
    orders_.push_back(std::move(order));
    wake_.notify_all();
  }
  [[nodiscard]] std::optional<RigOrder> next() {
    const std::lock_guard lock(mutex_);
    if (orders_.empty()) return std::nullopt;
    RigOrder order = std::move(orders_.front());
    orders_.pop_front();
    return order;
  }
  /// Returns when there is an order, or after a while.
  void wait(const std::stop_token& stop, std::chrono::milliseconds most) {
    std::unique_lock lock(mutex_);
    wake_.wait_for(lock, stop, most, [this] { return !orders_.empty(); });
  }
  void wake() { wake_.notify_all(); }

  /// What occupies the rig; empty: nothing.
  [[nodiscard]] std::string activity() const {
    const std::lock_guard lock(mutex_);
    return activity_;
  }
  /// Throws RigBusy if anything does.
  void require_free() const { require_none(activity()); }
  /// Goes over to another activity, `with` carried out at the same moment; false, and nothing changes, if a stop was
  /// asked for before.
  bool begin(const std::string& activity, const std::function<void()>& with) {
    const std::lock_guard lock(mutex_);
    if (stop_request_ != StopRequest::none) return false;
    activity_ = activity;
    with();
    return true;
  }
  void change(const std::string& activity) {
    const std::lock_guard lock(mutex_);
    activity_ = activity;
  }
  /// The rig is free again, `with` carried out at the same moment.
  void leave(const std::function<void()>& with = [] {}) {
    const std::lock_guard lock(mutex_);
    activity_.clear();
    with();
  }

  /// Stops what moves or is about to; without anything, `false`.
  bool stop(StopRequest how) {
    const std::lock_guard lock(mutex_);
    stop_request_ = std::max(stop_request_, how);
    return !activity_.empty() && activity_ != "writing";
  }
  [[nodiscard]] StopRequest stop_asked() const {
    const std::lock_guard lock(mutex_);
    return stop_request_;
  }
  /// Stops now and takes no more orders.
  void end() {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    stop_request_ = StopRequest::now;
  }
  /// True when nothing is going on or waiting.
  [[nodiscard]] bool idle() const {
    const std::lock_guard lock(mutex_);
    return activity_.empty() && orders_.empty();
  }

 private:
  static void require_none(const std::string& activity) {
    if (!activity.empty())
      throw RigBusy(fmt::format("the rig is {}; wait, or stop it first (diastole stop)", activity));
  }

  mutable InheritingMutex mutex_;  // the server's thread, which has no priority, holds it too
  std::condition_variable_any wake_;
  std::deque<RigOrder> orders_;
  std::string activity_;
  bool ending_ = false;
  StopRequest stop_request_ = StopRequest::none;
};

}  // namespace diastole
