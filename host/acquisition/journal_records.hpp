#pragma once
// What the payloads of a journal's records hold.
//
// document: one JSON object; "record" names what it is:
//   begin     {run_id, started_utc, producer, experiment, experiment_file, sample_rate_Hz, channels, rig,
//   instrument,
//              tick_rate_Hz, microstep_pL, daq_timer_rate_Hz, daq_timer_counts_samples,
//              segments[{start_s, waveform, ...}], waveforms[{segment, points, fraction}],
//              trigger_delay_s}
//   grid      {first_due_ns}                             host time at which sample 0 is due
//   gap       {first_index, count, reason}               of the sample stream
//   clock     {host_ns, tick, half_round_trip_ns}        controller against host
//   daq_clock {host_ns, timer, half_round_trip_ns}       instrument's timer against host; a timer that counts
//                                                        samples read k when sample k was taken
//   run_started {tick}   segment {segment, tick}   trigger {cycle, tick, r_wave}
//   slice     {block, slice, cycle, cycles, dummy_cycles} the slice's first cycle begins
//   run_ended {reason, schedule_done, tick, cycles, triggers, r_waves}
//   event     {host_ns or tick, level, code, text}
//   end       {until_ns}                                 the run was closed in order; samples that were due at or
//                                                        before that host time belong to it
//
// samples (little-endian):                     positions:
//   u64 first_index                               u32 first_index
//   u32 samples   u32 channels                    u32 count
//   samples x u64 host_ns                         u64 first_tick
//   samples x channels x f64 kPa                  u32 period_ticks
//                                                 count x i32 microsteps

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace diastole {

struct SampleBlock {
  uint64_t first_index = 0;
  uint32_t channels = 1;
  std::vector<uint64_t> host_ns;  ///< one a sample
  std::vector<double> value_kPa;  ///< row by row
};

struct PositionBlock {
  uint32_t first_index = 0;
  uint64_t first_tick = 0;
  uint32_t period_ticks = 0;
  std::vector<int32_t> microsteps;
};

std::vector<uint8_t> encode(const SampleBlock& block);
std::vector<uint8_t> encode(const PositionBlock& block);
/// None if the length does not fit the counts.
std::optional<SampleBlock> decode_samples(std::span<const uint8_t> payload);
std::optional<PositionBlock> decode_positions(std::span<const uint8_t> payload);

}  // namespace diastole
