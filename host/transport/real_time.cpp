#include "host/transport/real_time.hpp"

#include <sched.h>

namespace diastole {

void ask_for_real_time(int priority) {
  const sched_param parameter{priority};
  (void)::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameter);
}

InheritingMutex::InheritingMutex() {
  pthread_mutexattr_t attributes{};
  ::pthread_mutexattr_init(&attributes);
  ::pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
  ::pthread_mutex_init(&mutex_, &attributes);
  ::pthread_mutexattr_destroy(&attributes);
}

}  // namespace diastole
