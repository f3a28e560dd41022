#pragma once
// A queue between one producer and one consumer, one of which may be an interrupt. Memory is inside; the size
// is a power of two.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace diastole::firmware {

template <class T, std::size_t N>
class Ring {
  static_assert((N & (N - 1)) == 0);

 public:
  /// Producer. False when full.
  bool push(const T& value) {
    const std::uint32_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_.load(std::memory_order_acquire) == N) return false;
    slots_[tail % N] = value;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }
  /// Consumer. Null when empty; valid until pop().
  [[nodiscard]] const T* front() const {
    const std::uint32_t head = head_.load(std::memory_order_relaxed);
    return head == tail_.load(std::memory_order_acquire) ? nullptr : &slots_[head % N];
  }
  void pop() { head_.store(head_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }

  [[nodiscard]] std::size_t size() const {
    return tail_.load(std::memory_order_acquire) - head_.load(std::memory_order_acquire);
  }
  [[nodiscard]] bool full() const { return size() == N; }
  /// Only while the other side cannot run.
  void clear() { head_.store(tail_.load(std::memory_order_relaxed), std::memory_order_relaxed); }

 private:
  std::array<T, N> slots_{};
  std::atomic<std::uint32_t> head_{0};
  std::atomic<std::uint32_t> tail_{0};
};

}  // namespace diastole::firmware
