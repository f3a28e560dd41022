#pragma once
// A loop shared between threads. Bodies must touch disjoint data; which thread runs which index is not fixed,
// so results must not depend on it.

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

namespace diastole {

/// Calls body(i) for 0 <= i < count on at most `threads` threads, the caller's included; `body` must not
/// throw.
template <class Body>
void parallel_for(size_t count, size_t threads, const Body& body) {
  std::atomic<size_t> next{0};
  const auto work = [&] {
    for (size_t i = next++; i < count; i = next++)
      body(i);
  };
  std::vector<std::jthread> helpers;
  for (size_t t = 1; t < std::min(threads, count); ++t)
    helpers.emplace_back(work);
  work();
}

}  // namespace diastole
