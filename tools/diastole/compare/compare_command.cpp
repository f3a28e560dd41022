#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

#include "estimator/io/member_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/page.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/contract/plain_text.hpp"
#include "protocol/contract/waiting_line.hpp"
#include "protocol/runfile/reader.hpp"
#include "tools/diastole/commands.hpp"
#include "tools/diastole/compare/comparison.hpp"

namespace diastole {
namespace comparison {

DIASTOLE_MEMBERS(Difference, group, place, values)
DIASTOLE_MEMBERS(MeanCycle, run, cycles, mean_kPa, sd_kPa, error_kPa)

template <class Visit, IsRecord<Departure> Record>
void each_member(Visit&& visit, Record& departure) {
  DIASTOLE_VISIT(visit, departure, run, offset_Pa, gain, rms_Pa, worst_Pa, worst_phase, worst_in_errors,
                 limit_in_errors, allowed_Pa, range_Pa)
  const bool beyond_noise = departure.outcome() == Outcome::differs;
  visit("beyond_noise", beyond_noise);
  const bool undecided = departure.outcome() == Outcome::undecided;
  visit("undecided", undecided);
}

DIASTOLE_MEMBERS(Overlay, segment, channel, period_s, phase, cycles, departures)

template <class Visit, IsRecord<Comparison> Record>
void each_member(Visit&& visit, Record& comparison) {
  visit("runs", comparison.files);
  DIASTOLE_VISIT(visit, comparison, differences, overlays, remarks)
  const std::optional<Outcome> outcome = comparison.outcome();
  const bool is_tested = outcome.has_value();
  visit("is_tested", is_tested);
  const bool beyond_noise = outcome == Outcome::differs;
  visit("beyond_noise", beyond_noise);
  const bool undecided = outcome == Outcome::undecided;
  visit("undecided", undecided);
}

}  // namespace comparison

namespace {

using comparison::Comparison;
using comparison::Outcome;

struct CompareOptions {
  std::vector<std::filesystem::path> runs;
  std::filesystem::path page;
  size_t parts = 40;
  bool force = false;
};

std::string_view verb_of(Outcome outcome) {
  constexpr std::array<std::string_view, 3> verbs{"agrees with", "differs from",
                                                  "may agree with or differ from"};
  return verbs[static_cast<size_t>(outcome)];
}

std::string undecided_words(const comparison::Departure& departure) {
  if (departure.allowed_Pa <= 0) return "; the noise is not known";
  return fmt::format("; noise allows {} Pa of a trace of {} Pa", report::number(departure.allowed_Pa, 3),
                     report::number(departure.range_Pa, 3));
}

void show(const Comparison& found) {
  for (size_t i = 0; i < found.files.size(); ++i)
    print_plain("[{}] {}\n", i, found.files[i]);
  std::string group;
  for (const comparison::Difference& difference : found.differences) {
    if (difference.group != group) print_plain("{}\n", group = difference.group);
    print_plain("  {:28}", difference.place);
    for (const std::string& value : difference.values)
      print_plain("  {}", value.empty() ? "-" : value);
    print_plain("\n");
  }
  if (found.differences.empty()) print_plain("session, protocol, rig and calibration are the same\n");
  for (const comparison::Overlay& overlay : found.overlays) {
    for (const comparison::Departure& departure : overlay.departures) {
      print_plain(
          "segment {} {}: [{}] {} [0]: offset {} Pa, gain {}, rms {} Pa; worst {} Pa at phase {:.2f}, {} "
          "errors of {} allowed{}\n",
          overlay.segment, overlay.channel, departure.run, verb_of(departure.outcome()),
          report::number(departure.offset_Pa, 3), report::number(departure.gain, 5),
          report::number(departure.rms_Pa, 3), report::number(departure.worst_Pa, 3), departure.worst_phase,
          report::number(departure.worst_in_errors, 3), report::number(departure.limit_in_errors, 3),
          departure.outcome() == Outcome::undecided ? undecided_words(departure) : "");
    }
  }
  if (!found.outcome()) print_plain("no pressure could be tested against noise\n");
  for (const std::string& remark : found.remarks)
    print_plain("{}\n", remark);
}

ExitCode compare_runs(const CompareOptions& options, const CommandOutput& out) {
  if (options.runs.size() < 2)
    throw InputError({"", "RUN", "one run cannot be compared", "Give two run files or more."});
  if (!options.page.empty()) require_output({options.page, options.runs, report::page_mark, options.force});
  std::optional<WaitingLine> waiting(std::in_place, fmt::format("comparing {} runs", options.runs.size()));
  std::vector<runfile::RunFile> runs;
  std::vector<runfile::Session> sessions;
  for (const auto& file : options.runs) {
    runs.push_back(runfile::open_run(file));
    sessions.push_back(runfile::read_session(file));
  }
  const Comparison found = comparison::compare(runs, sessions, options.parts);
  if (!options.page.empty()) write_whole_file(options.page, comparison::comparison_page(found));
  waiting.reset();
  if (out.json) {
    Json document = written(found);
    document["page"] = options.page.empty() ? Json() : Json(options.page.string());
    std::cout << json_text(document, 2) << '\n';
    return ExitCode::done;
  }
  show(found);
  if (!options.page.empty()) fmt::print("The plots are in {}\n", options.page.string());
  return ExitCode::done;
}

}  // namespace

void add_compare(CommandLine& line) {
  auto options = std::make_shared<CompareOptions>();
  CLI::App* command = line.add(
      "compare", "what tells runs apart: session, protocol, rig, calibration, and pressure against noise",
      "  diastole compare monday.run.h5 tuesday.run.h5\n"
      "  diastole compare monday.run.h5 tuesday.run.h5 wednesday.run.h5 -o compared.html\n"
      "      each against the first, with the mean cycles, their differences and the bands of noise\n"
      "Only segments with the same motion are tested; those of another are shown all the same.");
  command->add_option("RUN", options->runs, "run files, the first is what the others are compared with")
      ->required();
  command->add_option("-o,--output", options->page, "HTML page with plots to write");
  command->add_option("--parts", options->parts, "into which a cycle is divided")
      ->check(number_between(4, 1000))
      ->capture_default_str();
  command->add_flag("--force", options->force, "replace an output file that is no report");
  line.on_run(command, [options](const CommandOutput& out) { return compare_runs(*options, out); });
}

}  // namespace diastole
