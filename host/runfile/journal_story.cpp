#include "host/runfile/journal_story.hpp"

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

using nlohmann::json;

constexpr double ns_per_s = 1e9;
constexpr double timer_span = 4294967296.0;  // the instrument's timer wraps at 32 bits

ClockPair pair_of(const json& record, double other_s) {
  return {record.at("host_ns").get<double>() / ns_per_s, other_s,
          record.at("half_round_trip_ns").get<double>() / ns_per_s};
}

class StoryTeller {
 public:
  explicit StoryTeller(JournalStory& story) : story_(story) {}

  void take_document(const json& record) {
    const std::string what = record.at("record");
    if (what == "begin") {
      story_.begin = record;
      tick_rate_Hz_ = record.at("tick_rate_Hz");
      timer_rate_Hz_ = record.at("daq_timer_rate_Hz");
    } else if (what == "clock") {
      story_.controller_pairs.push_back(pair_of(record, record.at("tick").get<double>() / tick_rate_Hz_));
    } else if (what == "daq_clock") {
      take_timer(record);
    } else if (what == "grid") {
      story_.first_due_ns = record.at("first_due_ns").get<uint64_t>();
    } else if (what == "gap") {
      story_.gaps.push_back({record.at("first_index"), record.at("count"), record.at("reason")});
    } else if (what == "run_started") {
      story_.start_tick = record.at("tick").get<uint64_t>();
    } else if (what == "segment") {
      story_.segment_starts.push_back(record);
    } else if (what == "trigger") {
      story_.triggers.push_back(record);
    } else if (what == "slice") {
      story_.slices.push_back(record);
    } else if (what == "run_ended") {
      story_.run_ended = record;
    } else if (what == "event") {
      story_.events.push_back(record);
    } else if (what == "end") {
      story_.closed = true;
    }
  }

  void take_samples(SampleBlock block) {
    if (block.first_index < next_sample_ || block.host_ns.empty()) return;
    next_sample_ = block.first_index + block.host_ns.size();
    story_.samples.push_back(std::move(block));
  }

 private:
  void take_timer(const json& record) {
    const double timer = record.at("timer");
    if (timer < last_timer_) timer_turns_ += 1;
    last_timer_ = timer;
    story_.daq_pairs.push_back(pair_of(record, (timer + timer_turns_ * timer_span) / timer_rate_Hz_));
  }

  JournalStory& story_;
  double tick_rate_Hz_ = 1;
  double timer_rate_Hz_ = 1;
  double last_timer_ = 0;
  double timer_turns_ = 0;
  uint64_t next_sample_ = 0;
};

}  // namespace

JournalStory read_story(const JournalContents& journal) {
  JournalStory story;
  StoryTeller teller(story);
  for (const JournalRecord& record : journal.records) {
    if (record.kind == RecordKind::samples) {
      if (auto block = decode_samples(record.payload)) teller.take_samples(std::move(*block));
    } else if (record.kind == RecordKind::positions) {
      if (auto block = decode_positions(record.payload)) story.positions.push_back(std::move(*block));
    } else if (record.kind == RecordKind::document) {
      const json document = json::parse(record.payload.begin(), record.payload.end(), nullptr, false);
      try {
        if (document.is_object()) teller.take_document(document);
      } catch (const json::exception&) {
        continue;  // whole by its CRC but not of this version's form: told as missing by what it leaves out
      }
    }
  }
  if (story.begin.is_null()) {
    throw InputError({journal.file, "", "has lost its first record, without which the rest has no meaning",
                      "This journal cannot be recovered."});
  }
  return story;
}

}  // namespace diastole
