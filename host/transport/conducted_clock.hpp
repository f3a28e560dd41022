#pragma once
// Time as a simulated rig conducts it: see protocol/contract/conductor.hpp for the exchange.

#include <string>

#include "host/transport/clock.hpp"
#include "host/transport/descriptor.hpp"
#include "protocol/contract/conductor.hpp"

namespace diastole {

class ConductedClock final : public Clock {
 public:
  /// Connects to the rig's socket. Throws HardwareError if nobody listens there.
  explicit ConductedClock(const std::string& path);

  /// Moves outside of sleeps only when the rig says so unasked.
  [[nodiscard]] uint64_t now_ns() override;
  /// Throws HardwareError if the rig has gone: without it time cannot go on.
  void sleep_until_ns(uint64_t until_ns, ByteLine* line) override;
  void line_opened(ByteLine& line) override;
  [[nodiscard]] bool stands_still() const override { return true; }

 private:
  void take(const conductor::Advanced& told);
  conductor::Advanced ask(const conductor::Advance& question);

  std::string path_;
  Descriptor socket_;
  uint64_t now_ns_ = 0;
  uint64_t sent_before_opening_ = 0;  // the rig's count when the line was opened, if it did not start anew
};

}  // namespace diastole
