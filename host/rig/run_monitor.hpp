#pragma once
// The present or last run as those see it who look on, and what they contribute to it: notes, and the operator's word
// that the next slice can begin. Of any thread.

#include <optional>
#include <string>
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

  void begin(const RunPlan& plan);
  void progress(const RunProgress& progress);
  void writing();
  void end(const RunResult& result);
  void remark(const RunRemark& remark);
  /// With remarks from number `first_remark` on; none if there was no run.
  [[nodiscard]] std::optional<RunState> state(size_t first_remark) const;
  /// Empty: there was none.
  [[nodiscard]] std::string run_id() const;

  void note(const RunRemark& note);
  std::vector<RunRemark> take_notes();
  /// The operator is ready for the slice that the run waits for, or for slice number `slice` if it is that one; none:
  /// nothing waits.
  std::optional<ContinuedSlice> go_on(std::optional<size_t> slice);
  std::optional<size_t> take_go_on();

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
