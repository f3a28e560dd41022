#include "tools/benchmarks/long_journal.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "host/journal/journal.hpp"
#include "host/journal/journal_records.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

using nlohmann::json;

constexpr uint64_t tick_rate_Hz = 84'000'000;
constexpr uint64_t ns_per_s = 1'000'000'000;
constexpr uint32_t positions_per_s = 300;
constexpr int blocks_per_s = 10;

json beginning(const JournalLoad& load) {
  json channels = json::array();
  for (int i = 0; i < load.channels; ++i)
    channels.push_back(i == 0 ? "cavity" : fmt::format("spare_{}", i));
  return {{"record", "begin"},
          {"run_id", "long"},
          {"started_utc", "2026-01-02T03:04:05Z"},
          {"producer", "bench"},
          {"experiment", ""},
          {"sample_rate_Hz", load.rate_Hz},
          {"channels", channels},
          {"rig", json::object()},
          {"tick_rate_Hz", tick_rate_Hz},
          {"microstep_pL", 7790},
          {"daq_timer_rate_Hz", 1.0},
          {"segments",
           {{{"start_s", 0.0},
             {"waveform", "parabolic"},
             {"stroke_mL", 0.0},
             {"period_s", 1.0},
             {"offset_mL", 0.0},
             {"cycles", load.seconds}}}}};
}

class LongJournal {
 public:
  LongJournal(const std::filesystem::path& path, const JournalLoad& load)
      : load_(load), journal_(path, [](int) { return 0; }) {}

  void write() {
    put(beginning(load_));
    put({{"record", "grid"}, {"first_due_ns", 0}});
    put({{"record", "run_started"}, {"tick", 0}});
    for (int second = 0; second < load_.seconds; ++second)
      write_second(static_cast<uint64_t>(second));
    write_positions(static_cast<uint64_t>(load_.seconds), 1);  // where the pump came to rest
    put({{"record", "run_ended"},
         {"reason", "completed"},
         {"tick", tick_rate_Hz * static_cast<uint64_t>(load_.seconds)},
         {"cycles", load_.seconds},
         {"triggers", load_.seconds}});
    put({{"record", "end"}});
  }

 private:
  void write_positions(uint64_t second, uint32_t count) {
    PositionBlock positions{static_cast<uint32_t>(second) * positions_per_s,
                            second * tick_rate_Hz,
                            static_cast<uint32_t>(tick_rate_Hz / positions_per_s),
                            {}};
    positions.microsteps.assign(count, 0);
    append(RecordKind::positions, encode(positions));
  }
  void write_second(uint64_t second) {
    put({{"record", "clock"},
         {"host_ns", second * ns_per_s},
         {"tick", second * tick_rate_Hz},
         {"half_round_trip_ns", 1000}});
    put({{"record", "trigger"}, {"cycle", second}, {"tick", second * tick_rate_Hz}});
    write_positions(second, positions_per_s);
    const auto rows = static_cast<uint64_t>(load_.rate_Hz / blocks_per_s);
    for (uint64_t block = 0; block < blocks_per_s; ++block) {
      SampleBlock samples{
          (second * blocks_per_s + block) * rows, static_cast<uint32_t>(load_.channels), {}, {}};
      for (uint64_t row = 0; row < rows; ++row) {
        samples.host_ns.push_back(static_cast<uint64_t>(static_cast<double>(samples.first_index + row) *
                                                        static_cast<double>(ns_per_s) / load_.rate_Hz));
        for (int i = 0; i < load_.channels; ++i)
          samples.value_kPa.push_back(noise_kPa_(random_));
      }
      append(RecordKind::samples, encode(samples));
    }
  }
  void put(const json& document) {
    const std::string text = document.dump();
    append(RecordKind::document, {text.begin(), text.end()});
  }
  void append(RecordKind kind, const std::vector<uint8_t>& payload) {
    if (!journal_.append(kind, payload))
      throw HardwareError(journal_.path().string(), journal_.problem(), "Make room.");
  }

  JournalLoad load_;
  JournalWriter journal_;
  std::mt19937 random_{1};
  std::normal_distribution<double> noise_kPa_{2, 0.05};
};

}  // namespace

void write_long_journal(const std::filesystem::path& path, const JournalLoad& load) {
  LongJournal(path, load).write();
}

}  // namespace diastole
