#pragma once
// glibc gives large blocks back to the kernel when they are freed, and gets them again page by page. Where threads make and drop arrays
// of 100 kB and more all the time, as in the fit of a lumen, that takes a quarter of it.

#include <cstdlib>
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace diastole {

/// From now on the process keeps what it frees, for its next blocks.
inline void keep_freed_memory() {
#ifdef __GLIBC__
  constexpr int mapped_alone_bytes = 32 << 20;  // the most that glibc takes
  constexpr int given_back_bytes = 256 << 20;
  mallopt(M_MMAP_THRESHOLD, mapped_alone_bytes);
  mallopt(M_TRIM_THRESHOLD, given_back_bytes);
#endif
}

}  // namespace diastole
