#pragma once
// Runs the jobs of a batch, each in a process of its own on a processor of its own, and remembers what became of them:
//
//   NAME.json       the command's document          NAME.log       what it said on standard error
//   NAME.job.json   how it ended, written last
//
// A job that has ended is not run again as long as its command line and its input's time are the same, unless it failed: a batch
// that was stopped goes on where it was, and one that a Slurm array ran is only gathered.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/diastole/batch/batch_file.hpp"

namespace diastole::batch {

enum class JobState {
  waiting,   ///< not run yet, or stopped
  done,      ///< exit code 0
  negative,  ///< exit code 1 and a document: it ran, its answer is negative
  failed
};
const char* word_of(JobState state);

struct JobEnd {
  JobState state = JobState::waiting;
  int exit_code = 0;  ///< -1 of a process that was killed
  double seconds = 0;
  std::string result;   ///< in a few words: "C1_kPa 8.57 +- 0.08"
  std::string message;  ///< of one that failed: the last it said
};

/// What is known of a job from an earlier run; waiting if that was another command line or input.
JobEnd remembered(const Batch& batch, const Job& job);

struct RunOptions {
  std::string program;  ///< the front door
  size_t at_once = 1;
  std::optional<size_t> only = {};  ///< this job alone, counted from 0
  std::function<bool()> interrupted = {};
  std::function<void(const std::vector<JobEnd>& ends, size_t running)> on_change =
      {};  ///< one call at a time
};

/// As many as there are jobs. Makes the batch's folder. Throws InputError if it cannot, or if another process works on it.
std::vector<JobEnd> run_batch(const Batch& batch, const RunOptions& options);

/// A script for `sbatch`: an array with one task a job, each running `program batch FILE --only N`.
std::string slurm_script(const Batch& batch, const std::string& program);

}  // namespace diastole::batch
