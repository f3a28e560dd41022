#pragma once
// CHOLMOD shares parts of a factorisation between four threads of GCC's OpenMP if it may. A forked process waits for ever for
// the threads that its parent had (docs/decisions/0012-newton-and-factorisation.md), waiting threads spin, and what there is to share is
// small.

#include <dlfcn.h>

namespace diastole {

/// From now on, parallel regions that the calling thread meets in a library have one thread.
inline void keep_openmp_serial() {
  using SetLevels = void (*)(int);
  static const auto set_levels =
      reinterpret_cast<SetLevels>(dlsym(RTLD_DEFAULT, "omp_set_max_active_levels"));
  if (set_levels != nullptr) set_levels(0);
}

}  // namespace diastole
