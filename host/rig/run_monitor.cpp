#include "host/rig/run_monitor.hpp"

#include <mutex>
#include <utility>

#include "host/rig/utc.hpp"

namespace diastole {

void RunMonitor::begin(const RunPlan& plan) {
  const std::lock_guard lock(mutex_);
  run_ = Run{plan};
  notes_.clear();
  go_on_.reset();
}

void RunMonitor::progress(const RunProgress& progress) {
  const std::lock_guard lock(mutex_);
  run_->progress = progress;
}

void RunMonitor::writing() {
  const std::lock_guard lock(mutex_);
  run_->state = "writing";
}

void RunMonitor::end(const RunResult& result) {
  const std::lock_guard lock(mutex_);
  run_->state = result.run_file.empty() ? "failed" : "done";
  run_->result = result;
}

void RunMonitor::remark(const RunRemark& remark) {
  const std::lock_guard lock(mutex_);
  run_->remarks.add(remark, utc_now());
}

std::optional<RunState> RunMonitor::state(size_t first_remark) const {
  const std::lock_guard lock(mutex_);
  if (!run_) return std::nullopt;
  return RunState{run_->plan, run_->state, run_->progress, run_->remarks.from(first_remark, remarks_at_once),
                  run_->result};
}

std::string RunMonitor::run_id() const {
  const std::lock_guard lock(mutex_);
  return run_ ? run_->plan.run_id : "";
}

void RunMonitor::note(const RunRemark& note) {
  const std::lock_guard lock(mutex_);
  notes_.push_back(note);
}

std::vector<RunRemark> RunMonitor::take_notes() {
  const std::lock_guard lock(mutex_);
  return std::exchange(notes_, {});
}

std::optional<ContinuedSlice> RunMonitor::go_on(std::optional<size_t> slice) {
  const std::lock_guard lock(mutex_);
  const auto* schedule =
      run_ && run_->state == "running" && run_->progress.schedule ? &*run_->progress.schedule : nullptr;
  if (schedule == nullptr || schedule->phase != "waiting") return std::nullopt;
  const auto waited_for = static_cast<size_t>(schedule->slice);
  if (slice && *slice != waited_for) return std::nullopt;
  go_on_ = waited_for;
  return ContinuedSlice{waited_for, schedule->prompt};
}

std::optional<size_t> RunMonitor::take_go_on() {
  const std::lock_guard lock(mutex_);
  return std::exchange(go_on_, std::nullopt);
}

}  // namespace diastole
