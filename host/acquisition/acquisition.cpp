#include "host/acquisition/acquisition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "host/acquisition/gap_remarks.hpp"
#include "host/acquisition/slice_tracker.hpp"
#include "host/gpio/gate_check.hpp"
#include "protocol/signal/low_pass.hpp"
#include "protocol/signal/saturation.hpp"
#include "protocol/wire/wire_text.hpp"

namespace diastole {
namespace {

constexpr uint64_t block_span_ns = 100'000'000;
constexpr uint64_t gap_interval_ns = 250'000'000;
constexpr double start_timeout_s = 2;  // for RunStarted
constexpr uint64_t tail_ns = 250'000'000;
constexpr double end_timeout_s = 10;  // for RunEnded, beyond the plan
constexpr double stop_timeout_s = 5;  // for RunEnded, after the journal failed
constexpr const char* journal_failed = "journal_failed";

class Acquisition {
 public:
  Acquisition(Clock& clock, Controller& controller, SampleSource& samples, JournalWriter& journal,
              AcquisitionSetup setup)
      : clock_(clock),
        controller_(controller),
        samples_(samples),
        journal_(journal),
        setup_(std::move(setup)),
        gap_remarks_([this](const std::string& code, const std::string& text) {
          hooks_.remark({"warning", code, text});
        }) {
    block_.channels = static_cast<uint32_t>(setup_.channels.size());
    saturation_.resize(setup_.channels.size());
    const signal::LowPassDesign design{.rate_Hz = setup_.sample_rate_Hz};
    if (design.rate_Hz >= signal::least_rate_over_cutoff * design.cutoff_Hz) live_filter_.emplace(design);
    if (!setup_.slices.empty()) schedule_.emplace(setup_.slices);
    show_schedule();
  }

  RunOutcome run(const AcquisitionHooks& hooks) {
    hooks_ = hooks;
    const SampleGrid grid = samples_.start(setup_.sample_rate_Hz);
    deadline_ns_ = clock_.now_ns() + static_cast<uint64_t>(start_timeout_s * ns_per_s);
    write(GridRecord{grid.first_due_ns});
    for (const std::string& warning : setup_.warnings)
      remark("warning", "instrument", warning);
    if (setup_.gate != nullptr) gate_.emplace(*setup_.gate);
    if (outcome_.end.empty()) {
      controller_.start();
    } else {
      ended_ = true;
    }
    while (!ended_)
      turn();
    const uint64_t until_ns = tail_until_ns_.value_or(clock_.now_ns());
    take_samples(samples_.finish(until_ns));
    end_missing();
    gap_remarks_.close(clock_.now_ns());
    close_block();
    close_gate();
    close_saturation();
    check_count(grid.due_by(until_ns));
    write(EndRecord{until_ns});
    ended_ = true;
    if (!journal_.sync()) fail_journal();
    hooks_.progress(outcome_.counts);
    return outcome_;
  }

 private:
  void turn() {
    obey(hooks_.stop());
    for (const RunRemark& note : hooks_.notes())
      remark(note.level, note.code, note.text);
    follow_schedule();
    controller_.service();
    for (const ControllerEvent& event : controller_.take_events())
      take(event);
    take_samples(samples_.take());
    gap_remarks_.update(clock_.now_ns());
    watch_gate();
    check_deadline();
    if (ended_) return;
    clock_.sleep_until_ns(std::min(samples_.next_due_ns(), controller_.next_due_ns()), controller_.line());
  }
  void obey(StopRequest request) {
    if (request <= obeyed_) return;
    obeyed_ = request;
    if (request == StopRequest::at_cycle_end) {
      remark("info", "stop", "stop at the end of this cycle was asked for");
    } else if (request == StopRequest::halt) {
      remark("warning", "stop", "a halt was asked for: the motion is cut off at once");
    } else {
      remark("warning", "stop", "controlled stop was asked for");
    }
    send_stop(request);
  }
  /// Everything but what would find the pump at rest, or about to stop at this very cycle's end.
  void send_stop(StopRequest request) {
    if (tail_until_ns_) return;
    if (request == StopRequest::halt) return controller_.halt();
    if (request == StopRequest::now) return controller_.stop_now();
    if (!schedule_stops_) controller_.stop_at_cycle_end();
  }
  void follow_schedule() {
    if (!schedule_ || schedule_->phase() != SliceTracker::Phase::waiting) return;
    if (!std::exchange(prompted_, true)) {
      remark("info", "prompt", schedule_->planned().prompt);
      show_schedule();
    }
    const std::optional<size_t> ready = setup_.prompts_answered ? schedule_->slice() : hooks_.go_on();
    if (!ready) return;
    schedule_->go_on(*ready);
    prompted_ = schedule_->phase() == SliceTracker::Phase::waiting;
    show_schedule();
  }
  void on_cycle(uint32_t cycle) {
    if (!schedule_ || schedule_stops_) return;
    const SliceTracker::Turn turn = schedule_->on_trigger();
    if (turn.slice_begins) {
      const PlannedSlice& slice = schedule_->planned();
      write(SliceRecord{slice.block, slice.number, cycle, slice.cycles, slice.dummy_cycles});
      remark("info", "slice",
             fmt::format("slice {} of {}: {} cycles of {}", schedule_->slice() + 1, schedule_->slices(),
                         slice.cycles, slice.block));
    }
    if (turn.last_cycle) {
      schedule_stops_ = true;
      if (obeyed_ == StopRequest::none) controller_.stop_at_cycle_end();  // otherwise a stop is under way
    }
    show_schedule();
  }
  void show_schedule() {
    if (!schedule_) return;
    outcome_.counts.schedule = {schedule_->planned().block,
                                static_cast<int64_t>(schedule_->slice()),
                                static_cast<int64_t>(schedule_->slices()),
                                phase_name(schedule_->phase()),
                                schedule_->cycles_left(),
                                prompted_ ? schedule_->planned().prompt : ""};
    hooks_.progress(outcome_.counts);
  }
  void take_samples(std::vector<SourceItem> items) {
    for (const SourceItem& item : items)
      std::visit([this](const auto& what) { take(what); }, item);
  }
  void take(const Received& received) {
    end_missing();
    const size_t channels = setup_.channels.size();
    if (block_.host_ns.empty()) block_.first_index = received.first_index;
    block_.host_ns.insert(block_.host_ns.end(), received.host_ns.begin(), received.host_ns.end());
    for (size_t i = 0; i < received.volts.size(); ++i) {
      const ChannelConfig& channel = setup_.channels[i % channels];
      block_.value_kPa.push_back((received.volts[i] - channel.zero_V) * channel.kPa_per_V);
      saturation_[i % channels].watch.push(block_.value_kPa.back());
      if (i % channels == 0) show(received.host_ns[i / channels], block_.value_kPa.back());
    }
    outcome_.counts.received += received.host_ns.size();
    watch_saturation();
    outcome_.counts.last_kPa = block_.value_kPa[block_.value_kPa.size() - channels];
    if (block_.host_ns.back() - block_.host_ns.front() >= block_span_ns) close_block();
  }
  /// Reports the first one at once, their number at the end.
  void watch_saturation() {
    const uint64_t before = outcome_.counts.saturated;
    outcome_.counts.saturated = 0;
    for (size_t i = 0; i < saturation_.size(); ++i) {
      const signal::SaturationWatch& watch = saturation_[i].watch;
      outcome_.counts.saturated += static_cast<uint64_t>(watch.samples());
      if (watch.samples() == 0 || std::exchange(saturation_[i].reported, true)) continue;
      remark(
          "warning", "saturated",
          fmt::format(
              "{} stands at {:.3f} kPa: the instrument's range ends there, and the pressure was beyond it",
              setup_.channels[i].name, watch.most().samples > 0 ? watch.most().value : watch.least().value));
    }
    if (outcome_.counts.saturated != before) hooks_.progress(outcome_.counts);
  }
  void close_saturation() {
    for (ChannelSaturation& channel : saturation_)
      channel.watch.finish();
    watch_saturation();
    for (size_t i = 0; i < saturation_.size(); ++i) {
      const int64_t samples = saturation_[i].watch.samples();
      if (samples == 0) continue;
      remark("error", "saturated",
             fmt::format("{} samples of {} stand at the end of the instrument's range", samples,
                         setup_.channels[i].name));
    }
  }
  void show(uint64_t host_ns, double kPa) {
    if (live_filter_) outcome_.counts.filtered_kPa = live_filter_->push(kPa);
    if (setup_.live == nullptr) return;
    setup_.live->sample(
        host_ns, kPa, live_filter_ ? outcome_.counts.filtered_kPa : std::numeric_limits<double>::quiet_NaN());
  }
  void take(const Missing& missing) {
    close_block();
    if (setup_.live != nullptr) setup_.live->gap();
    if (live_filter_) (void)live_filter_->push(std::numeric_limits<double>::quiet_NaN());
    if (gap_ && gap_->reason != missing.reason) close_gap();
    if (!gap_) gap_ = GapRecord{missing.first_index, 0, missing.reason};
    gap_->count += missing.count;
    gap_remarks_.missing(clock_.now_ns(), missing.count, missing.reason);
    outcome_.counts.missing += missing.count;
    write_lasting_gap();
  }
  void take(const InstrumentTime& time) {
    write(InstrumentClockRecord{time.host_ns, time.timer, time.half_round_trip_ns});
  }
  void take(const InstrumentFault& fault) { remark("warning", "instrument", fault.text); }
  void watch_gate() {
    if (!gate_) return;
    note(gate_->check(clock_.now_ns(), {outcome_.counts.triggers, stopped_by_estop_}));
    outcome_.counts.gate_pulses = gate_->pulses();
  }
  void close_gate() {
    if (!gate_) return;
    note(gate_->close(clock_.now_ns(), {outcome_.counts.triggers, stopped_by_estop_}, triggers_raised_));
  }
  void note(const std::vector<GateRemark>& remarks) {
    for (const GateRemark& each : remarks)
      keep({{}, each.host_ns, each.level, each.code, each.text});
  }
  void end_missing() {
    close_gap();
    gap_remarks_.received(clock_.now_ns());
  }
  void close_gap() {
    if (gap_) write(*std::exchange(gap_, std::nullopt));
  }
  /// A gap that lasts goes to the journal in parts, so that a crash within it leaves its record.
  void write_lasting_gap() {
    const uint64_t now_ns = clock_.now_ns();
    if (now_ns < gap_written_ns_ + gap_interval_ns) return;
    gap_written_ns_ = now_ns;
    close_gap();
  }
  /// What the source accounted for against what the clock says.
  void check_count(uint64_t due) {
    const uint64_t accounted = outcome_.counts.received + outcome_.counts.missing;
    if (accounted >= due) return;
    remark("error", "samples",
           fmt::format("{} samples were due, the instrument's driver accounted for {} only", due, accounted));
  }
  void close_block() {
    if (!block_.host_ns.empty()) write(block_);
    block_.host_ns.clear();
    block_.value_kPa.clear();
    hooks_.progress(outcome_.counts);
  }
  void take(const ControllerEvent& event) {
    std::visit(
        wire::overloaded{
            [&](const ClockReading& e) {
              if (setup_.live != nullptr) setup_.live->clock(e);
              write(ClockRecord{e.host_ns, e.tick, e.half_round_trip_ns});
            },
            [&](const wire::RunStarted& e) {
              started_ = true;
              if (setup_.live != nullptr) setup_.live->run_started(e.tick);
              deadline_ns_ = clock_.now_ns() +
                             static_cast<uint64_t>((setup_.planned_duration_s + end_timeout_s) * ns_per_s);
              write(RunStartedRecord{e.tick});
            },
            [&](const wire::SegmentStarted& e) {
              write(SegmentRecord{e.segment, e.tick});
            },
            [&](const wire::Trigger& e) {
              if (e.seen == 0) {
                remark("error", "trigger_lost",
                       fmt::format("the controller did not see the TTL of cycle {} rise", e.cycle), e.tick);
                on_cycle(e.cycle);
                return;
              }
              ++outcome_.counts.triggers;
              if (setup_.live != nullptr) setup_.live->trigger(e.tick);
              write(TriggerRecord{e.cycle, e.tick, e.r_wave});
              on_cycle(e.cycle);
            },
            [&](const wire::PositionBatch& e) {
              PositionBlock block{e.first_index, e.first_tick, e.period_ticks, {}};
              block.microsteps.assign(e.position_microsteps.begin(), e.position_microsteps.begin() + e.count);
              write(block);
            },
            [&](const wire::RunEnded& e) { take(e); },
            [&](const wire::FaultRaised& e) {
              stopped_by_estop_ = stopped_by_estop_ || e.fault == wire::Fault::estop;
              remark("error", std::string(wire::fault_name(e.fault)),
                     fmt::format("{} {}", wire::fault_explanation(e.fault), wire::fault_remedy(e.fault)),
                     e.tick);
            },
            [&](const wire::Nak& e) { take(e); },
            [&](const wire::StateChanged&) {},
            [&](const LinkBroken& e) {
              remark("error", "link_lost", e.reason + "; the pump stops by itself");
              end("link_lost");
            },
        },
        event);
  }
  void take(const wire::RunEnded& e) {
    outcome_.cycles = e.cycles;
    triggers_raised_ = e.triggers;
    const bool schedule_done = schedule_stops_ && wire::run_end_name(e.reason) == "stopped_at_cycle_end";
    const std::string reason = schedule_done ? "completed" : std::string(wire::run_end_name(e.reason));
    write(RunEndedRecord{reason, schedule_done, e.tick, e.cycles, e.triggers, e.r_waves});
    if (e.triggers != outcome_.counts.triggers) {
      remark("error", "triggers",
             fmt::format("the controller raised {} triggers, {} were reported", e.triggers,
                         outcome_.counts.triggers));
    }
    if (schedule_ && !schedule_stops_ && reason == "completed") {
      remark("error", "schedule",
             fmt::format("the pump has made all its cycles, but slice {} of {} was not imaged: "
                         "waiting took more than wait_cycles_at_most",
                         schedule_->slice() + 1, schedule_->slices()));
    }
    end_after_tail(reason);
  }
  /// Our own stop that crossed the end of the motion found what it wanted.
  void take(const wire::Nak& refusal) {
    const auto type = static_cast<wire::MessageType>(refusal.request_type);
    const bool of_a_stop = type == wire::MessageType::StopAtCycleEnd || type == wire::MessageType::StopNow ||
                           type == wire::MessageType::Halt;
    if (started_ && of_a_stop && refusal.refusal == wire::Refusal::wrong_state) {
      remark("info", "stop", "the stop that was asked for found the motion ended, or about to end");
      return;
    }
    remark("error", "refused", std::string(wire::refusal_explanation(refusal.refusal)));
    if (!started_) end("refused");
  }
  void remark(const std::string& level, const std::string& code, const std::string& text,
              std::optional<uint64_t> tick = {}) {
    keep({tick, tick ? 0 : clock_.now_ns(), level, code, text});
  }
  void keep(const EventRecord& event) {
    if (event.level == "error") note_error(event.text);
    write(event);
    hooks_.remark({event.level, event.code, event.text});
  }
  void note_error(const std::string& text) {
    if (outcome_.first_error.empty()) outcome_.first_error = text;
  }
  void write(const auto& record) {
    if (!append(journal_, record)) fail_journal();
  }
  void fail_journal() {
    if (outcome_.end == journal_failed) return;
    outcome_.end = journal_failed;
    note_error(journal_.problem());
    hooks_.remark({"error", journal_failed, journal_.problem() + "; the pump is being stopped"});
    if (tail_until_ns_) ended_ = true;  // the pump is at rest already
    if (ended_) return;
    controller_.stop_now();
    deadline_ns_ = clock_.now_ns() + static_cast<uint64_t>(stop_timeout_s * ns_per_s);
  }
  void end(std::string how) {
    if (outcome_.end.empty()) outcome_.end = std::move(how);
    ended_ = true;
  }
  void end_after_tail(std::string how) {
    if (outcome_.end == journal_failed) return end(std::move(how));
    outcome_.end = std::move(how);
    tail_until_ns_ = clock_.now_ns() + tail_ns;
  }
  void check_deadline() {
    if (tail_until_ns_) {
      const uint64_t now_ns = clock_.now_ns();
      const bool estop_undecided =
          gate_ && gate_->awaits_estop(now_ns, {outcome_.counts.triggers, stopped_by_estop_});
      ended_ =
          ended_ || (now_ns >= *tail_until_ns_ && samples_.complete(*tail_until_ns_) && !estop_undecided);
      return;
    }
    if (ended_ || clock_.now_ns() < deadline_ns_) return;
    remark("error", "overdue",
           started_ ? "the run did not end when it should have" : "the run did not start");
    controller_.stop_now();
    end("overdue");
  }

  Clock& clock_;
  Controller& controller_;
  SampleSource& samples_;
  JournalWriter& journal_;
  AcquisitionSetup setup_;
  AcquisitionHooks hooks_;

  SampleBlock block_;
  std::optional<GapRecord> gap_;  ///< that is open
  uint64_t gap_written_ns_ = 0;   ///< when part of a gap last went to the journal
  GapRemarks gap_remarks_;
  uint64_t deadline_ns_ = 0;
  StopRequest obeyed_ = StopRequest::none;
  struct ChannelSaturation {
    signal::SaturationWatch watch;
    bool reported = false;
  };
  std::vector<ChannelSaturation> saturation_;  ///< by channel
  std::optional<GateCheck> gate_;
  bool stopped_by_estop_ = false;
  std::optional<uint64_t> triggers_raised_;  ///< as the controller counted, at its end
  bool started_ = false;
  bool ended_ = false;
  std::optional<uint64_t> tail_until_ns_;
  RunOutcome outcome_;
  std::optional<signal::LowPass> live_filter_;  // of the first channel
  std::optional<SliceTracker> schedule_;
  bool prompted_ = false;
  bool schedule_stops_ = false;  // the last slice is being imaged, and a stop behind it is under way
};

}  // namespace

RunOutcome acquire(Clock& clock, Controller& controller, SampleSource& samples, JournalWriter& journal,
                   AcquisitionSetup setup, const AcquisitionHooks& hooks) {
  return Acquisition(clock, controller, samples, journal, std::move(setup)).run(hooks);
}

}  // namespace diastole
