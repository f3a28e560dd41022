// Calls go by MPI's profiling names (PMPI_...): the sequential MUMPS carries functions of the plain ones that do nothing.
//
// Rank 0's second thread hands out jobs and takes results while its first thread works like every other rank. Only
// that second thread speaks MPI meanwhile (MPI_THREAD_SERIALIZED).
//
//   tag 1   worker → 0   "give me a job" (no bytes)
//   tag 2   0 → worker   the job's number, or `no_more`
//   tag 3   worker → 0   the job's number and its result

#include <mpi.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <mutex>
#include <thread>

#include "estimator/montecarlo/worker_pool.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

enum Tag { ask_tag = 1, job_tag = 2, result_tag = 3 };
constexpr uint64_t no_more = UINT64_MAX;
constexpr std::chrono::milliseconds pause{
    2};  // between looks at the other ranks: MPI's own waiting burns a processor

class Coordinator {
 public:
  Coordinator(const std::vector<size_t>& jobs, const TakeResult& take) : jobs_(jobs), take_(take) {}

  uint64_t next() {
    const std::lock_guard lock(mutex_);
    return given_ < jobs_.size() ? jobs_[given_++] : no_more;
  }

  void take(uint64_t job, const std::string& result) {
    const std::lock_guard lock(mutex_);
    take_(job, result);
  }

  /// Until every other rank has received the message that there is no more.
  void serve(int others) {
    while (others > 0) {
      int waiting = 0;
      MPI_Status status;
      PMPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &waiting, &status);
      if (waiting == 0) {
        std::this_thread::sleep_for(pause);
        continue;
      }
      int size = 0;
      PMPI_Get_count(&status, MPI_BYTE, &size);
      std::string bytes(static_cast<size_t>(size), '\0');
      PMPI_Recv(bytes.data(), size, MPI_BYTE, status.MPI_SOURCE, status.MPI_TAG, MPI_COMM_WORLD,
                MPI_STATUS_IGNORE);
      if (status.MPI_TAG == result_tag) {
        uint64_t job = 0;
        std::memcpy(&job, bytes.data(), sizeof job);
        take(job, bytes.substr(sizeof job));
        continue;
      }
      const uint64_t job = next();
      if (job == no_more) --others;
      PMPI_Send(&job, sizeof job, MPI_BYTE, status.MPI_SOURCE, job_tag, MPI_COMM_WORLD);
    }
  }

 private:
  const std::vector<size_t>& jobs_;
  const TakeResult& take_;
  std::mutex mutex_;
  size_t given_ = 0;
};

void work_for_rank_0(const Work& work) {
  for (;;) {
    PMPI_Send(nullptr, 0, MPI_BYTE, 0, ask_tag, MPI_COMM_WORLD);
    uint64_t job = 0;
    PMPI_Recv(&job, sizeof job, MPI_BYTE, 0, job_tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    if (job == no_more) return;
    std::string message(sizeof job, '\0');
    std::memcpy(message.data(), &job, sizeof job);
    message += work(job);
    PMPI_Send(message.data(), static_cast<int>(message.size()), MPI_BYTE, 0, result_tag, MPI_COMM_WORLD);
  }
}

}  // namespace

bool in_mpi_world() {
  for (const char* mark : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK"}) {
    if (std::getenv(mark) != nullptr) return true;
  }
  return false;
}

MpiWorld::MpiWorld() {
  int provided = 0;
  PMPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided);
  PMPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  PMPI_Comm_size(MPI_COMM_WORLD, &size_);
  if (provided < MPI_THREAD_SERIALIZED) {
    throw InputError({"", "MPI", "is built without threads", "Use an MPI that has MPI_THREAD_SERIALIZED."});
  }
}

MpiWorld::~MpiWorld() {
  // A rank that fails must not leave the others waiting for ever.
  if (std::uncaught_exceptions() > 0) PMPI_Abort(MPI_COMM_WORLD, 2);
  PMPI_Finalize();
}

void MpiWorld::run(const std::vector<size_t>& jobs, const Work& work, const TakeResult& take) {
  if (rank_ != 0) return work_for_rank_0(work);
  Coordinator coordinator(jobs, take);
  std::jthread server([&] { coordinator.serve(size_ - 1); });
  for (uint64_t job = coordinator.next(); job != no_more; job = coordinator.next())
    coordinator.take(job, work(job));
}

}  // namespace diastole
