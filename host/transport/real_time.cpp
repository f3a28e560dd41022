#include "host/transport/real_time.hpp"

#include <sched.h>

namespace diastole {

void ask_for_real_time(int priority) {
  const sched_param parameter{priority};
  (void)::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameter);
}

}  // namespace diastole
