#pragma once
// Positions, answers and events into the link, in an order in which nothing overtakes: the outbox first, then
// batches of positions, and a run's end only behind its last position.

#include <algorithm>
#include <array>

#include "firmware/core/motion.hpp"
#include "firmware/core/outbox.hpp"
#include "protocol/wire/reliable_link.hpp"

namespace diastole::firmware {

template <Board B>
class Telemetry {
 public:
  /// Positions are sent in lots of this size: ten a second at 300 Hz.
  static constexpr std::size_t kBatch = 30;
  /// Places in the link's window that positions leave to answers.
  static constexpr std::size_t kReserve = 2;

  Telemetry(Motion<B>& motion, Outbox& outbox) : motion_(motion), outbox_(outbox) {}

  void pump(wire::ReliableLink& link) {
    motion_.engine().sample_to_now();
    if (motion_.run().start() != run_start_) {
      run_start_ = motion_.run().start();
      next_index_ = 0;
    }
    outbox_.flush(link);
    auto& samples = motion_.engine().samples();
    const std::size_t least = motion_.run().end_due() ? 1 : kBatch;
    while (link.room() > kReserve && samples.size() >= least)
      send_batch(link);
    if (motion_.run().end_due() && samples.size() == 0 && outbox_.empty()) {
      motion_.report_run_end();
      outbox_.flush(link);
    }
  }

 private:
  void send_batch(wire::ReliableLink& link) {
    auto& samples = motion_.engine().samples();
    const Ticks period{motion_.program().position_period_ticks};
    wire::PositionBatch batch;
    batch.first_index = next_index_;
    batch.first_tick = on_wire(run_start_ + period * std::int64_t{next_index_});
    batch.period_ticks = motion_.program().position_period_ticks;
    while (batch.count < wire::PositionBatch::kMaxCount) {
      const std::int32_t* position = samples.front();
      if (position == nullptr) break;
      batch.position_microsteps[batch.count++] = *position;
      samples.pop();
    }
    next_index_ += batch.count;
    std::array<std::uint8_t, wire::kMaxPayloadBytes> payload{};
    // pump() has seen room for it.
    (void)link.send(wire::PositionBatch::kType, wire::encode(batch, payload));
  }

  Motion<B>& motion_;
  Outbox& outbox_;
  Ticks run_start_;
  std::uint32_t next_index_ = 0;
};

}  // namespace diastole::firmware
