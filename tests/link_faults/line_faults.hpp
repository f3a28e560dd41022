#pragma once
// One direction of a bad line: bytes in, damaged bytes out. Seeded: equal seeds and equal frames in give equal
// bytes out, whatever the pieces in which the frames come. Used in-process by tests and by program link_faults.
//
//   LineFaults to_controller({.bit_error = 1e-4, .repetition = 0.01}, seed);
//   to_controller.push(bytes, now_us);
//   for (byte : to_controller.take(now_us)) ...
//
// The line is cut into frames at the 0x00 that ends each (protocol/wire/frame.hpp). Whole frames are lost,
// repeated, overtaken by up to kMostOvertaking others or cut off; then single bytes vanish and single bits flip,
// the delimiters among them. What has no end within kTimeout_us travels on as it is.

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <random>
#include <span>
#include <vector>

namespace diastole::link_faults {

/// Probabilities; all 0 is a good line.
struct FaultRates {
  double bit_error = 0;   ///< a bit: is flipped
  double byte_loss = 0;   ///< a byte: is missing
  double frame_loss = 0;  ///< a frame: is missing
  double repetition = 0;  ///< a frame: comes twice
  double reordering = 0;  ///< a frame: is overtaken by the next 1 … kMostOvertaking
  double truncation = 0;  ///< a frame: some of its end is missing, its 0x00 at least
  std::uint64_t delay_us = 0;
  std::uint64_t jitter_us = 0;  ///< at most so much more delay; does not change the order
};

struct FaultCounts {
  std::uint64_t frames = 0;  ///< that came in
  std::uint64_t damaged =
      0;  ///< frames (copies counted) of which a bit, a byte or the end is wrong or missing
  std::uint64_t bits_flipped = 0;
  std::uint64_t bytes_lost = 0;
  std::uint64_t lost = 0;
  std::uint64_t repeated = 0;
  std::uint64_t reordered = 0;
  std::uint64_t truncated = 0;
};

class LineFaults {
 public:
  static constexpr unsigned kMostOvertaking = 3;
  static constexpr std::uint64_t kTimeout_us = 20'000;

  LineFaults(FaultRates rates, std::uint64_t seed) : rates_(rates), random_(seed) {}

  /// For what comes from now on.
  void set_rates(const FaultRates& rates) { rates_ = rates; }

  void push(std::span<const std::uint8_t> bytes, std::uint64_t now_us) {
    for (const std::uint8_t byte : bytes) {
      if (begun_.empty()) begun_us_ = now_us;
      begun_.push_back(byte);
      if (byte == 0) end_frame(now_us);
    }
  }
  /// What has come through by now.
  std::vector<std::uint8_t> take(std::uint64_t now_us) {
    if (!begun_.empty() && now_us >= begun_us_ + kTimeout_us) {
      pass_on(std::move(begun_), now_us);
      begun_.clear();
    }
    release_held(now_us, false);
    Bytes through;
    while (!flying_.empty() && flying_.front().due_us <= now_us) {
      const Bytes& bytes = flying_.front().bytes;
      through.insert(through.end(), bytes.begin(), bytes.end());
      flying_.pop_front();
    }
    return through;
  }
  /// When take() will have something next; nullopt: not before something is pushed.
  [[nodiscard]] std::optional<std::uint64_t> next_due_us() const {
    std::optional<std::uint64_t> next;
    const auto consider = [&next](std::uint64_t due_us) { next = std::min(next.value_or(due_us), due_us); };
    if (!flying_.empty()) consider(flying_.front().due_us);
    for (const Held& held : held_)
      consider(held.deadline_us);
    if (!begun_.empty()) consider(begun_us_ + kTimeout_us);
    return next;
  }

  [[nodiscard]] const FaultCounts& counts() const { return counts_; }

 private:
  using Bytes = std::vector<std::uint8_t>;
  struct Flying {
    std::uint64_t due_us;
    Bytes bytes;
  };
  struct Held {
    unsigned overtaking;  ///< frames that are still to pass
    std::uint64_t deadline_us;
    Bytes bytes;
  };

  bool happens(double probability) {
    return probability > 0 && std::bernoulli_distribution(probability)(random_);
  }
  void end_frame(std::uint64_t now_us) {
    Bytes frame;
    frame.swap(begun_);
    ++counts_.frames;
    if (happens(rates_.frame_loss)) {
      ++counts_.lost;
      return;
    }
    if (happens(rates_.reordering)) {
      ++counts_.reordered;
      const auto overtaking = 1 + static_cast<unsigned>(random_() % kMostOvertaking);
      held_.push_back({overtaking, now_us + kTimeout_us, std::move(frame)});
      return;
    }
    const bool twice = happens(rates_.repetition);
    if (twice) {
      ++counts_.repeated;
      pass_on(frame, now_us);
    }
    pass_on(std::move(frame), now_us);
    release_held(now_us, true);
  }
  void pass_on(Bytes frame, std::uint64_t now_us) {
    std::uint64_t due_us = now_us + rates_.delay_us;
    if (rates_.jitter_us > 0) due_us += random_() % (rates_.jitter_us + 1);
    last_due_us_ = std::max(last_due_us_, due_us);
    flying_.push_back({last_due_us_, damaged(std::move(frame))});
  }
  void release_held(std::uint64_t now_us, bool passed_by) {
    for (auto held = held_.begin(); held != held_.end();) {
      if (passed_by && held->overtaking > 0) --held->overtaking;
      if (held->overtaking > 0 && now_us < held->deadline_us) {
        ++held;
        continue;
      }
      pass_on(std::move(held->bytes), now_us);
      held = held_.erase(held);
    }
  }
  Bytes damaged(Bytes frame) {
    const FaultCounts before = counts_;
    if (happens(rates_.truncation)) {
      ++counts_.truncated;
      frame.resize(random_() % frame.size());
    }
    if (rates_.byte_loss > 0) {
      const auto size = frame.size();
      std::erase_if(frame, [this](std::uint8_t) { return happens(rates_.byte_loss); });
      counts_.bytes_lost += size - frame.size();
    }
    if (rates_.bit_error > 0) {
      std::geometric_distribution<std::size_t> gap(rates_.bit_error);
      for (std::size_t bit = gap(random_); bit < frame.size() * 8; bit += 1 + gap(random_)) {
        frame[bit / 8] = static_cast<std::uint8_t>(frame[bit / 8] ^ (1U << (bit % 8)));
        ++counts_.bits_flipped;
      }
    }
    if (counts_.truncated != before.truncated || counts_.bytes_lost != before.bytes_lost ||
        counts_.bits_flipped != before.bits_flipped)
      ++counts_.damaged;
    return frame;
  }

  FaultRates rates_;
  std::mt19937_64 random_;
  FaultCounts counts_;
  Bytes begun_;  ///< a frame whose end has not come yet
  std::uint64_t begun_us_ = 0;
  std::vector<Held> held_;
  std::deque<Flying> flying_;
  std::uint64_t last_due_us_ = 0;
};

}  // namespace diastole::link_faults
