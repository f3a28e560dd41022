#pragma once
// The present or last run as those see it who look on, and what they contribute to it: notes, and the operator's word
// that the next slice can begin. Of any thread.

#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/rig/remark_log.hpp"
#include "host/rig/rig_answers.hpp"
#include "host/transport/real_time.hpp"

namespace diastole {

struct RunPlan {
  std::string run_id;
  double planned_s = 0;   ///< the controller's program, with what a schedule allows for waiting
  double estimate_s = 0;  ///< without that
  int64_t planned_cycles = 0;
};

struct RunState {
  RunPlan plan;
  std::string state;  ///< "running", "writing", "done", "failed"
  RunProgress progress;
  RemarkLog::Page remarks;
  std::optional<RunResult> result;
};

class RunMonitor {
 public:
  static constexpr size_t remarks_at_once = 200;

  void begin(const RunPlan& plan) {
    const std::lock_guard lock(mutex_);
    run_ = Run{plan};
    notes_.clear();
    go_on_.reset();
  }
  void progress(const RunProgress& progress) {
    const std::lock_guard lock(mutex_);
    run_->progress = progress;
  }
  void writing() {
    const std::lock_guard lock(mutex_);
    run_->state = "writing";
  }
  void end(const RunResult& result) {
    const std::lock_guard lock(mutex_);
    run_->state = result.run_file.empty() ? "failed" : "done";
    run_->result = result;
  }
  void remark(const RunRemark& remark) {
    const std::lock_guard lock(mutex_);
    run_->remarks.add(remark, utc_now());
  }
  /// With remarks from number `first_remark` on; none if there was no run.
  [[nodiscard]] std::optional<RunState> state(size_t first_remark) const {
    const std::lock_guard lock(mutex_);
    if (!run_) return std::nullopt;
    return RunState{run_->plan, run_->state, run_->progress,
                    run_->remarks.from(first_remark, remarks_at_once), run_->result};
  }
  /// Empty: there was none.
  [[nodiscard]] std::string run_id() const {
    const std::lock_guard lock(mutex_);
    return run_ ? run_->plan.run_id : "";
  }

  void note(const RunRemark& note) {
    const std::lock_guard lock(mutex_);
    notes_.push_back(note);
  }
  std::vector<RunRemark> take_notes() {
    const std::lock_guard lock(mutex_);
    return std::exchange(notes_, {});
  }
  /// The operator is ready for the slice that the run waits for, or for slice number `slice` if it is that one; none:
  /// nothing waits.
  std::optional<ContinuedSlice> go_on(std::optional<size_t> slice) {
    const std::lock_guard lock(mutex_);
    const auto* schedule =
        run_ && run_->state == "running" && run_->progress.schedule ? &*run_->progress.schedule : nullptr;
    if (schedule == nullptr || schedule->phase != "waiting") return std::nullopt;
    const auto waited_for = static_cast<size_t>(schedule->slice);
    if (slice && *slice != waited_for) return std::nullopt;
    go_on_ = waited_for;
    return ContinuedSlice{waited_for, schedule->prompt};
  }
  std::optional<size_t> take_go_on() {
    const std::lock_guard lock(mutex_);
    return std::exchange(go_on_, std::nullopt);
  }

 private:
  struct Run {
    RunPlan plan;
    std::string state = "running";
    RunProgress progress = {};
    RemarkLog remarks = RemarkLog();
    std::optional<RunResult> result = {};
  };

  mutable InheritingMutex mutex_;
  std::optional<Run> run_;
  std::vector<RunRemark> notes_;
  std::optional<size_t> go_on_;
};

}  // namespace diastole
