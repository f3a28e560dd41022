#include "tools/sim_board/core/nvic.hpp"

#include <algorithm>

namespace diastole::board_model {

void Nvic::reset() {
  pending_.reset();
  enabled_.reset();
  active_.reset();
  lines_.fill(0);
  running_.clear();
  priority_.fill(0);
  priority_[exception::nmi] = -2;
  priority_[exception::hard_fault] = -1;
  for (const uint32_t always :
       {exception::nmi, exception::hard_fault, exception::sv_call, exception::pend_sv, exception::sys_tick}) {
    enabled_[always] = true;
  }
  prigroup_ = 0;
  find_best();
  find_active();
}

void Nvic::set_line(uint32_t irq, bool high, uint32_t source) {
  const uint32_t number = exception::first_irq + irq;
  const auto before = lines_[number];
  const uint32_t bit = 1U << source;
  lines_[number] = static_cast<uint8_t>(high ? before | bit : before & ~bit);
  if (before == 0 && high) set_pending(number);
}

void Nvic::set_pending(uint32_t number) {
  if (!pending_[number]) pending_since_[number] = clock_.now();
  pending_[number] = true;
  find_best();
}

void Nvic::clear_pending(uint32_t number) {
  pending_[number] = lines_[number] != 0;
  find_best();
}

void Nvic::set_enabled(uint32_t number, bool enabled) {
  enabled_[number] = enabled;
  find_best();
}

void Nvic::set_priority(uint32_t number, uint8_t value) {
  if (number <= exception::hard_fault) return;
  priority_[number] = value & 0xf0;
  find_best();
  find_active();
}

void Nvic::set_priority_grouping(uint32_t prigroup) {
  prigroup_ = prigroup & 7;
  find_best();
  find_active();
}

int Nvic::group(int priority) const { return priority < 0 ? priority : priority & ~((2 << prigroup_) - 1); }

int Nvic::execution_priority(const Masks& masks) const {
  int boundary = active_group_;
  if (masks.basepri & 0xff) boundary = std::min(boundary, group(static_cast<int>(masks.basepri & 0xff)));
  if (masks.primask & 1) boundary = std::min(boundary, 0);
  if (masks.faultmask & 1) boundary = std::min(boundary, -1);
  return boundary;
}

bool Nvic::deliverable(const Masks& masks) const {
  return best_ != 0 && best_group_ < execution_priority(masks);
}

bool Nvic::could_take(uint32_t number, const Masks& masks) const {
  return group(priority_[number]) < execution_priority(masks);
}

void Nvic::enter(uint32_t number, uint64_t instructions) {
  InterruptCost& cost = costs_[number];
  ++cost.count;
  if (pending_[number]) {
    cost.worst_latency_cycles =
        std::max(cost.worst_latency_cycles, clock_.now() - std::min(clock_.now(), pending_since_[number]));
  }
  pending_[number] = false;
  active_[number] = true;
  running_.push_back({number, instructions, 0});
  find_best();
  find_active();
}

bool Nvic::leave(uint32_t number, uint64_t instructions) {
  if (running_.empty() || running_.back().number != number) return false;
  const Running done = running_.back();
  running_.pop_back();
  const uint64_t spent = instructions - done.start;
  InterruptCost& cost = costs_[number];
  cost.worst_instructions = std::max(cost.worst_instructions, spent - done.preempted);
  if (!running_.empty()) running_.back().preempted += spent;
  active_[number] = false;
  if (lines_[number] != 0) set_pending(number);
  find_best();
  find_active();
  return true;
}

void Nvic::find_best() {
  best_ = 0;
  best_group_ = idle_priority;
  const auto ready = pending_ & enabled_;
  if (ready.none()) return;
  int best_priority = idle_priority;
  for (auto number = static_cast<uint32_t>(ready._Find_first()); number < exception_count;
       number = static_cast<uint32_t>(ready._Find_next(number))) {
    if (priority_[number] < best_priority) {
      best_priority = priority_[number];
      best_ = number;
    }
  }
  best_group_ = group(best_priority);
}

void Nvic::find_active() {
  active_group_ = idle_priority;
  for (const Running& running : running_) {
    active_group_ = std::min(active_group_, group(priority_[running.number]));
  }
}

}  // namespace diastole::board_model
