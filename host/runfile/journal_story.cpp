#include "host/runfile/journal_story.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

using nlohmann::json;

constexpr double ns_per_s = 1e9;
constexpr double timer_span = 4294967296.0;  // the instrument's timer wraps at 32 bits
constexpr uint64_t most_ticks = uint64_t{1} << 62;
constexpr uint64_t most_counts = uint64_t{1} << 40;
constexpr double highest_rate_Hz = 1e12;

/// A whole number from 0 to `most`; JSON's other numbers would be rounded or wrapped.
uint64_t whole(const json& record, const char* name, uint64_t most) {
  const json& value = record.at(name);
  if (!value.is_number_unsigned() || value.get<uint64_t>() > most) {
    throw std::out_of_range(name);
  }
  return value.get<uint64_t>();
}

uint64_t ticks(const json& record, const char* name) { return whole(record, name, most_ticks); }

int64_t count(const json& record, const char* name) {
  return static_cast<int64_t>(whole(record, name, most_counts));
}

double rate_Hz(const json& record, const char* name) {
  const double value = record.at(name);
  if (!(value >= 1e-3 && value <= highest_rate_Hz)) throw std::out_of_range(name);
  return value;
}

ClockPair pair_of(const json& record, double other_s) {
  return {static_cast<double>(ticks(record, "host_ns")) / ns_per_s, other_s,
          static_cast<double>(ticks(record, "half_round_trip_ns")) / ns_per_s};
}

/// What is neither a number nor a text is left out; so is a number that was none when it was written.
std::map<std::string, runfile::Attribute, std::less<>> rig_attributes(const json& rig) {
  std::map<std::string, runfile::Attribute, std::less<>> attributes;
  for (const auto& [name, value] : rig.items()) {
    if (value.is_string()) {
      attributes[name] = value.get<std::string>();
    } else if (value.is_number_integer()) {
      attributes[name] = value.get<int64_t>();
    } else if (value.is_number()) {
      attributes[name] = value.get<double>();
    }
  }
  return attributes;
}

Beginning beginning_of(const json& record) {
  Beginning begin;
  begin.run_id = record.at("run_id");
  begin.started_utc = record.at("started_utc");
  begin.producer = record.at("producer");
  begin.experiment = record.at("experiment");
  begin.experiment_file = record.value("experiment_file", "");
  begin.sample_rate_Hz = rate_Hz(record, "sample_rate_Hz");
  begin.tick_rate_Hz = rate_Hz(record, "tick_rate_Hz");
  begin.daq_timer_rate_Hz = rate_Hz(record, "daq_timer_rate_Hz");
  begin.daq_timer_counts_samples = record.value("daq_timer_counts_samples", false);
  begin.microstep_pL = record.at("microstep_pL");
  begin.trigger_delay_s = record.value("trigger_delay_s", 0.0);
  begin.channels = record.at("channels").get<std::vector<std::string>>();
  begin.rig = rig_attributes(record.at("rig"));
  for (const json& segment : record.at("segments")) {
    begin.segments.push_back({segment.at("start_s"), segment.at("waveform"), segment.at("stroke_mL"),
                              segment.at("period_s"), segment.at("offset_mL"), count(segment, "cycles")});
  }
  for (const json& played : record.value("waveforms", json::array())) {
    begin.waveforms.push_back({static_cast<size_t>(count(played, "segment")), played.at("points"),
                               played.at("fraction").get<std::vector<double>>()});
  }
  return begin;
}

NotedEvent event_of(const json& record) {
  NotedEvent event{.level = record.at("level"), .code = record.at("code"), .text = record.at("text")};
  if (record.contains("tick")) {
    event.tick = ticks(record, "tick");
  } else {
    event.host_ns = ticks(record, "host_ns");
  }
  return event;
}

class StoryTeller {
 public:
  explicit StoryTeller(JournalStory& story) : story_(story) {}

  /// Throws what std::exception covers if the record is not of its form; then nothing of it is taken.
  void take_document(const json& record) {
    const std::string what = record.at("record");
    if (what == "begin") {
      story_.begin = beginning_of(record);
      begun_ = true;
    } else if (what == "clock") {
      story_.controller_pairs.push_back(
          pair_of(record, static_cast<double>(ticks(record, "tick")) / story_.begin.tick_rate_Hz));
    } else if (what == "daq_clock") {
      take_timer(record);
    } else if (what == "grid") {
      story_.first_due_ns = ticks(record, "first_due_ns");
    } else if (what == "gap") {
      take_gap(
          {whole(record, "first_index", most_rows), whole(record, "count", most_rows), record.at("reason")});
    } else if (what == "run_started") {
      story_.start_tick = ticks(record, "tick");
    } else if (what == "segment") {
      story_.segment_starts.push_back({static_cast<size_t>(count(record, "segment")), ticks(record, "tick")});
    } else if (what == "trigger") {
      story_.triggers.push_back({count(record, "cycle"), ticks(record, "tick")});
    } else if (what == "slice") {
      story_.slices.push_back({record.at("block"), count(record, "slice"), count(record, "cycle"),
                               count(record, "cycles"), count(record, "dummy_cycles")});
    } else if (what == "run_ended") {
      story_.run_ended = EndOfRun{record.at("reason"), record.value("schedule_done", false),
                                  ticks(record, "tick"), count(record, "cycles"), count(record, "triggers")};
    } else if (what == "event") {
      story_.events.push_back(event_of(record));
    } else if (what == "end") {
      if (record.contains("until_ns")) story_.until_ns = ticks(record, "until_ns");
      story_.closed = true;
    }
  }

  [[nodiscard]] bool begun() const { return begun_; }

 private:
  void take_gap(DeclaredGap gap) {
    if (gap.first_index + gap.count > most_rows) return;
    story_.sample_rows = std::max(story_.sample_rows, gap.first_index + gap.count);
    story_.gaps.push_back(std::move(gap));
  }

  void take_timer(const json& record) {
    const auto timer = static_cast<double>(ticks(record, "timer"));
    const double turns = timer_turns_ + (timer < last_timer_ ? 1 : 0);
    story_.daq_pairs.push_back(
        pair_of(record, (timer + turns * timer_span) / story_.begin.daq_timer_rate_Hz));
    last_timer_ = timer;
    timer_turns_ = turns;
  }

  JournalStory& story_;
  bool begun_ = false;
  double last_timer_ = 0;
  double timer_turns_ = 0;
};

void follow(const PositionBlock& block, std::optional<PositionFacts>& facts) {
  if (block.microsteps.empty() || block.first_tick > most_ticks) return;
  if (!facts) facts = {block.first_index, block.first_tick, block.period_ticks, 0};
  const uint64_t behind = block.microsteps.size() - 1;
  facts->last_tick = std::max(facts->last_tick, block.first_tick + behind * block.period_ticks);
}

class BlockReader {
 public:
  explicit BlockReader(BlockTakers take) : take_(std::move(take)) {}

  void take(const JournalRecord& record) {
    if (record.kind == RecordKind::samples) {
      if (const auto block = decode_samples(record.payload)) take_samples(*block);
    } else if (record.kind == RecordKind::positions) {
      const auto block = decode_positions(record.payload);
      if (block && uint64_t{block->first_index} + block->microsteps.size() <= most_rows)
        take_.positions(*block);
    }
  }

 private:
  void take_samples(const SampleBlock& block) {
    if (block.first_index < next_sample_ || block.host_ns.empty()) return;
    if (block.first_index + block.host_ns.size() > most_rows || block.first_index > most_rows) return;
    next_sample_ = block.first_index + block.host_ns.size();
    take_.samples(block);
  }

  BlockTakers take_;
  uint64_t next_sample_ = 0;
};

}  // namespace

JournalStory read_story(const JournalRecords& journal) {
  JournalStory story;
  StoryTeller teller(story);
  BlockReader blocks({.samples =
                          [&](const SampleBlock& block) {
                            story.sample_rows =
                                std::max(story.sample_rows, block.first_index + block.host_ns.size());
                            story.last_sample_ns = std::max(story.last_sample_ns, block.host_ns.back());
                          },
                      .positions = [&](const PositionBlock& block) { follow(block, story.positions); }});
  story.damage = journal.each([&](const JournalRecord& record) {
    if (record.kind != RecordKind::document) return blocks.take(record);
    const json document = json::parse(record.payload.begin(), record.payload.end(), nullptr, false);
    try {
      if (document.is_object()) teller.take_document(document);
    } catch (const json::exception&) {
      // whole by its CRC but not of this version's form: told as missing by what it leaves out
    } catch (const std::out_of_range&) {
    }
  });
  if (!teller.begun()) {
    throw InputError({journal.file(), "", "has lost its first record, without which the rest has no meaning",
                      "This journal cannot be recovered."});
  }
  return story;
}

void read_blocks(const JournalRecords& journal, const BlockTakers& take) {
  BlockReader blocks(take);
  journal.each([&](const JournalRecord& record) { blocks.take(record); });
}

}  // namespace diastole
