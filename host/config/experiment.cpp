#include "host/config/experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "protocol/contract/bounded_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"
#include "protocol/wire/program_messages.hpp"

namespace diastole {
namespace {

constexpr std::string_view waveform_names[] = {
#define DIASTOLE_WAVEFORM(number, name) #name,
#include "protocol/wire/waveform_list.inc"
};

/// The waveforms as files spell them, in the order of their numbers on the wire.
std::vector<std::string> spelled_waveforms() {
  std::vector<std::string> names(std::begin(waveform_names), std::end(waveform_names));
  for (std::string& name : names)
    std::replace(name.begin(), name.end(), '_', '-');
  return names;
}

/// Reads the segments of one experiment and gathers the waveforms that they name.
class SegmentReader {
 public:
  SegmentReader(Experiment& experiment, const ReadPoints& read_points)
      : experiment_(experiment), read_points_(read_points) {}

  void read(TableReader table) {
    const std::vector<std::string> waveforms = spelled_waveforms();
    ExperimentSegment segment;
    segment.waveform_name = table.choice("waveform", waveforms);
    const auto number =
        std::find(waveforms.begin(), waveforms.end(), segment.waveform_name) - waveforms.begin();
    segment.waveform = static_cast<wire::Waveform>(number);
    constexpr NumberRange volume{.at_least = 0, .at_most = 4000};
    constexpr NumberRange period{.at_least = 0.001, .at_most = 600};
    if (segment.waveform == wire::Waveform::uploaded) segment.upload = waveform_of(table);
    const std::optional<double> range_mL = of_points(segment, &PointsFile::range_mL);
    const std::optional<double> cycle_s = of_points(segment, &PointsFile::cycle_s);
    const bool holds = segment.waveform == wire::Waveform::hold;
    segment.stroke_mL = holds || range_mL ? table.number_or("stroke_mL", range_mL.value_or(0), volume)
                                          : table.number("stroke_mL", volume);
    segment.offset_mL = table.number_or("offset_mL", 0, volume);
    segment.period_s =
        cycle_s ? table.number_or("period_s", *cycle_s, period) : table.number("period_s", period);
    segment.cycles = table.integer_or("cycles", 1, {.at_least = 1, .at_most = 10'000'000});
    table.finish();
    tables_.push_back(std::move(table));
    experiment_.segments.push_back(segment);
  }

  /// Shares the controller's memory out: evenly spaced points take what they need, the others the rest alike.
  void put_on_even_phases() {
    size_t room = wire::kMaxWaveformPoints, uneven = 0;
    for (const ExperimentWaveform& waveform : experiment_.waveforms) {
      const size_t points = even_points(waveform.points);
      if (points > room)
        fail(waveform, fmt::format("with it the waveforms have {} points too many", points - room),
             fmt::format("The controller holds {} points of all waveforms together: thin them out, "
                         "or split the experiment into several runs.",
                         wire::kMaxWaveformPoints));
      room -= points;
      uneven += points == 0 ? 1 : 0;
    }
    constexpr size_t least_grid = 64;
    for (ExperimentWaveform& waveform : experiment_.waveforms) {
      if (even_points(waveform.points) == 0 && room / uneven < least_grid)
        fail(waveform, "leaves no room for its unevenly spaced points beside the other waveforms",
             "Thin the others out, or split the experiment into several runs.");
      waveform.even = on_even_phases(waveform.points, uneven > 0 ? room / uneven : room);
    }
  }

 private:
  size_t waveform_of(TableReader& table) {
    const std::string name = table.text("points");
    std::vector<ExperimentWaveform>& known = experiment_.waveforms;
    const auto found = std::ranges::find(known, name, &ExperimentWaveform::name);
    if (found != known.end()) return static_cast<size_t>(found - known.begin());
    if (known.size() == wire::kMaxWaveforms)
      table.fail("points", fmt::format("is the waveform number {} of this experiment", known.size() + 1),
                 fmt::format("The controller holds {} at a time: split the experiment into several runs.",
                             wire::kMaxWaveforms));
    if (!read_points_) table.fail("points", "cannot be read here", "Run the experiment from its file.");
    known.push_back({name, parse_points(read_points_(name), name), {}});
    return known.size() - 1;
  }
  [[nodiscard]] std::optional<double> of_points(const ExperimentSegment& segment,
                                                std::optional<double> PointsFile::*what) const {
    return segment.upload ? experiment_.waveforms[*segment.upload].points.*what : std::nullopt;
  }
  [[noreturn]] void fail(const ExperimentWaveform& waveform, const std::string& problem,
                         const std::string& remedy) const {
    const auto number = static_cast<size_t>(&waveform - experiment_.waveforms.data());
    const auto segment =
        std::ranges::find(experiment_.segments, std::optional(number), &ExperimentSegment::upload);
    tables_[static_cast<size_t>(segment - experiment_.segments.begin())].fail("points", problem, remedy);
  }

  Experiment& experiment_;
  const ReadPoints& read_points_;
  std::vector<TableReader> tables_;
};

/// The schedule says how many cycles its one segment has.
void put_schedule(const TableReader& root, TableReader table, Experiment& experiment) {
  ExperimentSegment& segment = experiment.segments.front();
  if (experiment.segments.size() > 1 || segment.cycles != 1 || segment.waveform == wire::Waveform::hold) {
    root.fail("schedule", "needs one [[segment]] that moves, without cycles",
              "The schedule itself tells how many cycles there are; run other motions as experiments of "
              "their own.");
  }
  experiment.schedule = read_schedule(std::move(table), segment.period_s);
  segment.cycles = experiment.schedule->cycles_at_most();
}

}  // namespace

int64_t Experiment::cycles() const {
  int64_t total = 0;
  for (const ExperimentSegment& segment : segments)
    total += segment.cycles;
  return total;
}

int64_t Experiment::planned_cycles() const { return schedule ? schedule->cycles() : cycles(); }

double Experiment::estimate_s() const {
  if (!schedule) return least_duration_s();
  return rest_s + segments.front().period_s * static_cast<double>(planned_cycles());
}

double Experiment::least_duration_s() const {
  double total_s = rest_s;
  for (const ExperimentSegment& segment : segments)
    total_s += segment.period_s * static_cast<double>(segment.cycles);
  return total_s;
}

Experiment parse_experiment(std::string_view text, const std::string& file, const ReadPoints& read_points) {
  TableReader root = TableReader::from_text(text, file);
  root.expect_format("diastole-experiment", 1);
  Experiment experiment;
  experiment.file = file;
  experiment.text = std::string(text);
  (void)root.text_or("name", "");
  experiment.sample_rate_Hz = root.number_or("sample_rate_Hz", 300, {.at_least = 1, .at_most = 20'000});
  experiment.gate_every = root.integer_or("gate_every", 1, {.at_least = 1, .at_most = 10'000});
  experiment.trigger_delay_ms = root.number_or("trigger_delay_ms", 0, {.at_least = 0, .at_most = 10'000});
  constexpr double least_delay_ms = 0.1;
  if (experiment.trigger_delay_ms > 0 && experiment.trigger_delay_ms < least_delay_ms)
    root.fail("trigger_delay_ms", fmt::format("is {:g}", experiment.trigger_delay_ms),
              "Give 0, or 0.1 and more.");
  experiment.rest_s = root.number_or("rest_s", 1.0, {.at_least = 0.001, .at_most = 60});
  SegmentReader segments(experiment, read_points);
  for (TableReader& table : root.tables("segment"))
    segments.read(std::move(table));
  if (experiment.segments.empty()) root.fail("segment", "is missing", "Add at least one [[segment]].");
  if (auto schedule = root.table_if("schedule")) put_schedule(root, std::move(*schedule), experiment);
  root.finish();
  segments.put_on_even_phases();
  return experiment;
}

Experiment read_experiment(const std::string& file) {
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  return parse_experiment(read_bounded_file(file, most_settings_bytes), file, [&](const std::string& name) {
    return read_bounded_file(folder / name, most_table_bytes);
  });
}

void leave_out(Experiment& study, std::set<int64_t> done) {
  study.schedule->done = std::move(done);
  study.segments.front().cycles = study.schedule->cycles_at_most();
}

std::vector<std::string> doubts_about(const Experiment& experiment) {
  constexpr double least_usual_stroke_mL = 1, mL_per_L = 1000;
  std::vector<std::string> doubts;
  for (size_t i = 0; i < experiment.segments.size(); ++i) {
    const double stroke_mL = experiment.segments[i].stroke_mL;
    if (stroke_mL <= 0 || stroke_mL >= least_usual_stroke_mL) continue;
    doubts.push_back(
        fmt::format("segment[{}].stroke_mL: a stroke of {:g} mL; {:g}? (It is in mL, not in litres.)", i,
                    stroke_mL, mL_per_L * stroke_mL));
  }
  return doubts;
}

}  // namespace diastole
