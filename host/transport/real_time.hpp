#pragma once
// Priority over other programs.

#include <pthread.h>
#include <sched.h>

namespace diastole {

inline constexpr int instrument_priority = 50;  ///< asks nobody, and loses a sample when late
inline constexpr int rig_priority = 40;         ///< owes the controller a heart-beat every lease

/// Asks for SCHED_FIFO at this priority for the calling thread, where the system allows it (CAP_SYS_NICE, or
/// RLIMIT_RTPRIO); without effect elsewhere. Threads that it starts have none of it.
inline void ask_for_real_time(int priority) {
  const sched_param parameter{priority};
  (void)::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameter);
}

/// A mutex whose holder has the priority of who waits for it, as long as that lasts: it is not kept from the processor by
/// other programs meanwhile. A Lockable.
class InheritingMutex {
 public:
  InheritingMutex() {
    pthread_mutexattr_t attributes{};
    ::pthread_mutexattr_init(&attributes);
    ::pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    ::pthread_mutex_init(&mutex_, &attributes);
    ::pthread_mutexattr_destroy(&attributes);
  }
  ~InheritingMutex() { ::pthread_mutex_destroy(&mutex_); }
  InheritingMutex(const InheritingMutex&) = delete;
  InheritingMutex& operator=(const InheritingMutex&) = delete;

  void lock() { ::pthread_mutex_lock(&mutex_); }
  bool try_lock() { return ::pthread_mutex_trylock(&mutex_) == 0; }
  void unlock() { ::pthread_mutex_unlock(&mutex_); }

 private:
  pthread_mutex_t mutex_{};
};

}  // namespace diastole
