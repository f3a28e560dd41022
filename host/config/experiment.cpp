#include "host/config/experiment.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole {
namespace {

constexpr std::string_view waveform_names[] = {
#define DIASTOLE_WAVEFORM(number, name) #name,
#include "protocol/wire/waveform_list.inc"
#undef DIASTOLE_WAVEFORM
};

/// The waveforms as files spell them, in the order of their numbers on the wire.
std::vector<std::string> spelled_waveforms() {
  std::vector<std::string> names(std::begin(waveform_names), std::end(waveform_names));
  for (std::string& name : names)
    std::replace(name.begin(), name.end(), '_', '-');
  return names;
}

ExperimentSegment read_segment(TableReader table) {
  const std::vector<std::string> waveforms = spelled_waveforms();
  ExperimentSegment segment;
  segment.waveform_name = table.choice("waveform", waveforms);
  const auto number =
      std::find(waveforms.begin(), waveforms.end(), segment.waveform_name) - waveforms.begin();
  segment.waveform = static_cast<wire::Waveform>(number);
  constexpr NumberRange volume{.at_least = 0, .at_most = 4000};
  segment.stroke_mL = segment.waveform == wire::Waveform::hold ? table.number_or("stroke_mL", 0, volume)
                                                               : table.number("stroke_mL", volume);
  segment.offset_mL = table.number_or("offset_mL", 0, volume);
  segment.period_s = table.number("period_s", {.at_least = 0.001, .at_most = 600});
  segment.cycles = table.integer_or("cycles", 1, {.at_least = 1, .at_most = 10'000'000});
  table.finish();
  return segment;
}

}  // namespace

int64_t Experiment::cycles() const {
  int64_t total = 0;
  for (const ExperimentSegment& segment : segments)
    total += segment.cycles;
  return total;
}

double Experiment::least_duration_s() const {
  double total_s = rest_s;
  for (const ExperimentSegment& segment : segments)
    total_s += segment.period_s * static_cast<double>(segment.cycles);
  return total_s;
}

Experiment parse_experiment(std::string_view text, const std::string& file) {
  TableReader root = TableReader::from_text(text, file);
  root.expect_format("diastole-experiment", 1);
  Experiment experiment;
  experiment.file = file;
  experiment.text = std::string(text);
  (void)root.text_or("name", "");
  experiment.sample_rate_Hz = root.number_or("sample_rate_Hz", 300, {.at_least = 1, .at_most = 20'000});
  experiment.gate_every = root.integer_or("gate_every", 1, {.at_least = 1, .at_most = 10'000});
  experiment.rest_s = root.number_or("rest_s", 1.0, {.at_least = 0.001, .at_most = 60});
  for (TableReader& table : root.tables("segment"))
    experiment.segments.push_back(read_segment(std::move(table)));
  if (experiment.segments.empty()) root.fail("segment", "is missing", "Add at least one [[segment]].");
  root.finish();
  return experiment;
}

Experiment read_experiment(const std::string& file) {
  std::ifstream stream(file);
  std::stringstream text;
  if (!stream || !(text << stream.rdbuf())) {
    throw InputError({file, "", "cannot be opened", "Check the path and that you may read the file."});
  }
  return parse_experiment(text.str(), file);
}

}  // namespace diastole
