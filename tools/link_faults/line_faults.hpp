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
// the delimiters among them. What has no end within kPatience_us travels on as it is.

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
  static constexpr std::uint64_t kPatience_us = 20'000;

  LineFaults(FaultRates rates, std::uint64_t seed) : rates_(rates), random_(seed) {}

  /// For what comes from now on.
  void set_rates(const FaultRates& rates) { rates_ = rates; }

  void push(std::span<const std::uint8_t> bytes, std::uint64_t now_us);
  /// What has come through by now.
  std::vector<std::uint8_t> take(std::uint64_t now_us);
  /// When take() will have something next; nullopt: not before something is pushed.
  [[nodiscard]] std::optional<std::uint64_t> next_due_us() const;

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

  bool happens(double probability);
  void end_frame(std::uint64_t now_us);
  void pass_on(Bytes frame, std::uint64_t now_us);
  void release_held(std::uint64_t now_us, bool passed_by);
  Bytes damaged(Bytes frame);

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
