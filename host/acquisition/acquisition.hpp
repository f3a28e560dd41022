#pragma once
// One run: polls the instrument at the sample rate, takes in the controller's events, and writes both to the
// journal, until the controller says that the run has ended, and a quarter of a second more: the last cycle,
// which counts from its trigger, ends a little after the last step.
//
// Samples lie on a grid: sample k is due at first_due + k / rate. Each index is either received or declared
// missing, and the declaration tells why:
//   - the instrument failed to answer, or kept the loop waiting while the sample came due;
//   - the loop came so late, for another reason, that sample k+1 was already due (an overrun).
// So received + missing = expected by construction; `RunOutcome` counts them.
//
// The loop is single-threaded in time: it reads and waits for time through one Clock only.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/acquisition/journal.hpp"
#include "host/acquisition/journal_records.hpp"
#include "host/config/rig_config.hpp"
#include "host/controller/controller.hpp"
#include "host/daq/instrument.hpp"
#include "host/transport/clock.hpp"

namespace diastole {

enum class StopRequest { none, at_cycle_end, now };

/// A remark for the person in front: what the run file's /events will hold.
struct RunRemark {
  std::string level;  ///< "info", "warning", "error"
  std::string code;
  std::string text;
};

struct RunProgress {
  uint64_t received = 0;  ///< samples
  uint64_t missing = 0;
  uint64_t triggers = 0;
  double last_kPa = 0;  ///< of the first channel
};

struct RunOutcome {
  std::string end;  ///< "completed", "stopped_at_cycle_end", ..., "link_lost", "journal_failed"
  uint32_t cycles = 0;
  RunProgress counts;
  [[nodiscard]] bool regular() const {
    return end == "completed" || end == "stopped_at_cycle_end" || end == "stopped_now";
  }
};

struct AcquisitionSetup {
  double sample_rate_Hz = 300;
  std::vector<ChannelConfig> channels;
  double planned_duration_s = 0;  ///< a run that has not ended well after this is broken off
};

class Acquisition {
 public:
  Acquisition(Clock& clock, Controller& controller, daq::Instrument& instrument, JournalWriter& journal,
              AcquisitionSetup setup);

  struct Hooks {
    std::function<StopRequest()> stop = [] { return StopRequest::none; };  ///< asked once a turn
    /// What others want in the run's events; asked once a turn.
    std::function<std::vector<RunRemark>()> notes = [] { return std::vector<RunRemark>(); };
    std::function<void(const RunProgress&)> progress = [](const RunProgress&) {};
    std::function<void(const RunRemark&)> remark = [](const RunRemark&) {};
  };

  /// Starts the armed program and returns when it has ended, one way or another.
  RunOutcome run(const Hooks& hooks);

 private:
  void turn();
  void obey(StopRequest request);
  void poll_instrument();
  /// Declares the indices from next_index_ up to `index` missing.
  void miss_until(uint64_t index);
  /// Whether it was received.
  bool take_sample(uint64_t index);
  void miss(uint64_t first, uint64_t count, const std::string& reason);
  void end_missing();
  void close_gap();
  void close_block();
  void read_instrument_clock();
  void take(const ControllerEvent& event);
  void remark(const std::string& level, const std::string& code, const std::string& text,
              std::optional<uint64_t> tick = {});
  void write(RecordKind kind, const auto& payload);
  void fail_journal();
  void end(std::string how);
  void end_after_tail(std::string how);
  void check_deadline();
  [[nodiscard]] uint64_t due_ns(uint64_t index) const;

  Clock& clock_;
  Controller& controller_;
  daq::Instrument& instrument_;
  JournalWriter& journal_;
  AcquisitionSetup setup_;
  Hooks hooks_;

  uint64_t first_due_ns_ = 0;
  uint64_t next_index_ = 0;
  SampleBlock block_;
  std::vector<double> volts_;
  struct OpenGap {
    uint64_t first = 0;
    uint64_t count = 0;
    std::string reason;
  };
  std::optional<OpenGap> gap_;
  uint64_t missing_in_a_row_ = 0;  ///< over all reasons
  struct Request {
    uint64_t until_ns = 0;
    std::string reason;  ///< why what came due before until_ns could not be sampled
  };
  Request last_request_;  ///< to the instrument
  uint64_t next_instrument_clock_ns_ = 0;
  uint64_t deadline_ns_ = 0;
  StopRequest obeyed_ = StopRequest::none;
  bool started_ = false;
  bool ended_ = false;
  std::optional<uint64_t> tail_until_ns_;
  RunOutcome outcome_;
};

}  // namespace diastole
