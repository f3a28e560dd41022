#include "estimator/parallel/parallel_for.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace diastole {
namespace {

TEST(ParallelFor, CallsEachIndexOnce) {
  std::vector<std::atomic<int>> calls(1000);
  parallel_for(calls.size(), 4, [&](size_t i) { ++calls[i]; });
  for (const auto& count : calls)
    EXPECT_EQ(count, 1);
}

TEST(ParallelFor, AnExceptionReachesTheCallerAndEndsTheLoop) {
  for (const size_t threads : {1U, 4U}) {
    std::atomic<size_t> begun = 0;
    const auto throwing = [&](size_t i) {
      ++begun;
      if (i >= 10) throw std::runtime_error("no further");
    };
    EXPECT_THROW(parallel_for(100000, threads, throwing), std::runtime_error) << threads;
    EXPECT_LE(begun, 10 + threads);
  }
}

}  // namespace
}  // namespace diastole
