#pragma once
// A journal's records, sorted by what they tell; the step between bytes and a run.

#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "host/acquisition/journal.hpp"
#include "host/acquisition/journal_records.hpp"
#include "host/controller/clock_map.hpp"

namespace diastole {

struct DeclaredGap {
  uint64_t first_index = 0;
  uint64_t count = 0;
  std::string reason;
};

struct JournalStory {
  nlohmann::json begin;
  std::optional<uint64_t> first_due_ns;  ///< host time of sample 0, if its record is there
  std::vector<SampleBlock> samples;      ///< in order of their index, whole and without overlap
  std::vector<DeclaredGap> gaps;
  std::vector<PositionBlock> positions;
  std::vector<ClockPair> controller_pairs;  ///< other = controller ticks / tick rate
  std::vector<ClockPair> daq_pairs;         ///< other = instrument timer / its rate, unwrapped
  std::optional<uint64_t> start_tick;
  std::vector<nlohmann::json> segment_starts;
  std::vector<nlohmann::json> triggers;
  std::vector<nlohmann::json> slices;
  std::vector<nlohmann::json> events;
  std::optional<nlohmann::json> run_ended;
  bool closed = false;  ///< the last record says that the run was closed in order
};

/// Throws InputError when the journal has no beginning. A record that does not fit its kind is left out, as
/// if it had been damaged.
JournalStory read_story(const JournalContents& journal);

}  // namespace diastole
