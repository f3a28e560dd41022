#pragma once
// A loop shared between threads. Bodies must touch disjoint data; which thread runs which index is not fixed,
// so results must not depend on it.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace diastole {

/// What the machine runs at once.
inline size_t machine_threads() { return std::max(1U, std::thread::hardware_concurrency()); }

/// Calls body(i) for 0 <= i < count on at most `threads` threads, the caller's included. If a body throws, no further
/// index is begun, and the first exception is thrown to the caller once all threads are done.
template <class Body>
void parallel_for(size_t count, size_t threads, const Body& body) {
  std::atomic<size_t> next{0};
  std::mutex failing;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (size_t i = next++; i < count; i = next++)
        body(i);
    } catch (...) {
      next = count;
      const std::scoped_lock lock(failing);
      if (!failure) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (size_t t = 1; t < std::min(threads, count); ++t)
      helpers.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace diastole
