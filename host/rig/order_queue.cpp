#include "host/rig/order_queue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

void require_none(const std::string& activity) {
  if (!activity.empty())
    throw RigBusy(fmt::format("the rig is {}; wait, or stop it first (diastole stop)", activity));
}

}  // namespace

void OrderQueue::give(RigOrder order) {
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

std::optional<RigOrder> OrderQueue::next() {
  const std::lock_guard lock(mutex_);
  if (orders_.empty()) return std::nullopt;
  RigOrder order = std::move(orders_.front());
  orders_.pop_front();
  return order;
}

void OrderQueue::wait(const std::stop_token& stop, std::chrono::milliseconds most) {
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, stop, most, [this] { return !orders_.empty(); });
}

std::string OrderQueue::activity() const {
  const std::lock_guard lock(mutex_);
  return activity_;
}

void OrderQueue::require_free() const { require_none(activity()); }

bool OrderQueue::begin(const std::string& activity, const std::function<void()>& with) {
  const std::lock_guard lock(mutex_);
  if (stop_request_ != StopRequest::none) return false;
  activity_ = activity;
  with();
  return true;
}

void OrderQueue::change(const std::string& activity) {
  const std::lock_guard lock(mutex_);
  activity_ = activity;
}

void OrderQueue::leave(const std::function<void()>& with) {
  const std::lock_guard lock(mutex_);
  activity_.clear();
  with();
}

bool OrderQueue::stop(StopRequest how) {
  const std::lock_guard lock(mutex_);
  stop_request_ = std::max(stop_request_, how);
  return !activity_.empty() && activity_ != "writing";
}

StopRequest OrderQueue::stop_asked() const {
  const std::lock_guard lock(mutex_);
  return stop_request_;
}

void OrderQueue::end() {
  const std::lock_guard lock(mutex_);
  ending_ = true;
  stop_request_ = StopRequest::now;
}

bool OrderQueue::idle() const {
  const std::lock_guard lock(mutex_);
  return activity_.empty() && orders_.empty();
}

}  // namespace diastole
