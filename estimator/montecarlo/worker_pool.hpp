#pragma once
// Independent jobs on several processes. Processes, not threads: MUMPS without MPI keeps global state, and a fleet
// has no shared memory anyway. A job is a number, its result a line of text.

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace diastole {

/// Runs in a worker process.
using Work = std::function<std::string(size_t job)>;
/// Called in the coordinating process, one at a time, in the order in which results come.
using TakeResult = std::function<void(size_t job, const std::string& result)>;

/// Workers forked from this process: what it holds (a solved truth, say) is theirs at no cost. With one worker the
/// work runs in this process. A worker that dies is an InputError that names its job; results that came are kept.
/// Each worker is bound to its share of the processors.
/// Precondition: no other threads in this process.
void run_forked(const std::vector<size_t>& jobs, size_t workers, const Work& work, const TakeResult& take);

/// Whether a launcher (mpirun, srun) started this process as one of an MPI world.
bool in_mpi_world();

/// The MPI world while it lives. One at most a process.
class MpiWorld {
 public:
  MpiWorld();
  ~MpiWorld();
  MpiWorld(const MpiWorld&) = delete;
  MpiWorld& operator=(const MpiWorld&) = delete;

  [[nodiscard]] int rank() const { return rank_; }
  [[nodiscard]] int size() const { return size_; }

  /// Every rank calls it; rank 0 also hands out `jobs` (the other ranks' are not looked at) and takes the results,
  /// while it works itself.
  void run(const std::vector<size_t>& jobs, const Work& work, const TakeResult& take);

 private:
  int rank_ = 0;
  int size_ = 1;
};

}  // namespace diastole
