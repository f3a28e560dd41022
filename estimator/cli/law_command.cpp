#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/interruption.hpp"
#include "estimator/cli/study_options.hpp"
#include "estimator/io/member_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/law_fit/law_comparison.hpp"
#include "estimator/materials/file_law.hpp"
#include "estimator/report/page.hpp"
#include "estimator/report/sections.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/contract/named_members.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole {
namespace {

struct LawArguments {
  std::vector<std::filesystem::path> data;
  std::vector<std::string> laws;
  std::optional<std::filesystem::path> page;
  bool force = false;
};

const Law& named_law(const std::string& name) {
  if (name.ends_with(".toml")) return law_of_file(name);
  if (const Law* law = find_law(name)) return *law;
  std::vector<std::string> known;
  for (const Law* law : all_laws())
    known.emplace_back(law->name());
  throw InputError({"", "", fmt::format("there is no law \"{}\"", name),
                    fmt::format("{}Give one of {}, or a file NAME.law.toml.", did_you_mean(name, known),
                                fmt::join(known, ", "))});
}

/// Those that were asked for; else all built-in ones that these tests can fit.
std::vector<const Law*> chosen_laws(const LawArguments& arguments, const std::vector<BenchTest>& tests) {
  std::vector<const Law*> laws;
  for (const std::string& name : arguments.laws) {
    const Law& law = named_law(name);
    check_law(law, tests);
    if (std::ranges::find(laws, &law) == laws.end()) laws.push_back(&law);
  }
  if (!arguments.laws.empty()) return laws;
  for (const Law* law : all_laws())
    if (why_not(*law, tests).empty()) laws.push_back(law);
  if (laws.empty()) check_law(*all_laws().front(), tests);
  return laws;
}

const char* bound_word(inference::BoundSide side) {
  return side == inference::BoundSide::none    ? "none"
         : side == inference::BoundSide::lower ? "lower"
                                               : "upper";
}

Json json_of(const LawFit& fit, const std::vector<BenchTest>& tests) {
  Json parameters = Json::object(), undetermined = Json::array(), channels = Json::array();
  for (const LawParameterEstimate& parameter : fit.parameters) {
    parameters[parameter.name] = {{"value", written(parameter.value)},
                                  {"se", written(parameter.se)},
                                  {"ci95", written(parameter.ci95)},
                                  {"bound", bound_word(parameter.bound)}};
  }
  for (const Undetermined& combination : fit.undetermined) {
    undetermined.push_back({{"change_percent", written(by_name(combination.change_percent))},
                            {"sd_percent", written(combination.sd_percent)}});
  }
  for (const ChannelFit& channel : fit.channels) {
    const BenchTest& test = tests[channel.test];
    channels.push_back({{"file", test.file},
                        {"channel", test.channels[channel.channel].name},
                        {"rms", channel.rms},
                        {"r2", written(channel.r2)},
                        {"predicted", channel.predicted}});
  }
  Json correlation = Json::array();
  for (const auto& row : fit.correlation.rowwise())
    correlation.push_back(std::vector<double>(row.begin(), row.end()));
  return {{"law", fit.law->name()},
          DIASTOLE_NAMED(fit, settled, reason),
          {"determined", fit.determined()},
          {"parameters", parameters},
          {"undetermined", undetermined},
          {"correlation", correlation},
          {"error_percent", fit.error_percent},
          DIASTOLE_NAMED(fit, dof, starts, agreeing),
          {"channels", channels},
          {"remarks", fit.remarks}};
}

std::string to_json(const std::vector<BenchTest>& tests, const LawComparison& comparison) {
  Json of_tests = Json::array(), laws = Json::array();
  for (const BenchTest& test : tests) {
    Json channels = Json::array();
    for (const Channel& channel : test.channels)
      channels.push_back({{"name", channel.name}, {"rms", channel.rms}});
    of_tests.push_back({{"file", test.file},
                        {"kind", test.kind->name},
                        {"readings", test.readings.size()},
                        {"channels", channels}});
  }
  for (const ComparedLaw& law : comparison.laws) {
    Json& of_law = laws.emplace_back(json_of(law.fit, tests));
    Json left_out = Json::array();
    for (size_t i = 0; i < law.left_out.size(); ++i) {
      left_out.push_back({{"left_out", comparison.folds[i]},
                          {"error_percent", written(law.left_out[i].error_percent)},
                          {"determined", law.left_out[i].determined}});
    }
    of_law["left_out"] = left_out;
    of_law["predicted_percent"] = written(law.predicted_percent);
    of_law["told_apart"] = law.distinguished;
  }
  const auto& preferred = comparison.preferred;
  const Json json = {
      {"tests", of_tests},
      {"over_kinds", comparison.over_kinds},
      {"preferred", preferred ? Json(comparison.laws[*preferred].fit.law->name()) : Json(nullptr)},
      {"why", comparison.why},
      {"laws", laws}};
  return json_text(json, 1) + "\n";
}

std::string percent_words(double percent) {
  return std::isfinite(percent) ? fmt::format("{:.3g}", percent) : "-";
}

void print_law(const LawFit& fit) {
  fmt::print("\n{}: what was measured within {:.3g} %\n", fit.law->name(), fit.error_percent);
  for (const LawParameterEstimate& parameter : fit.parameters) {
    const std::string interval = parameter.bound != inference::BoundSide::none ? "on its bound"
                                 : std::isfinite(parameter.se)
                                     ? fmt::format("\u00b1 {:.2g}  (95 % interval {:.4g} to {:.4g})",
                                                   parameter.se, parameter.ci95[0], parameter.ci95[1])
                                     : "not determined";
    fmt::print("  {:<10} {:>10.4g} {}\n", parameter.name, parameter.value, interval);
  }
  for (const Undetermined& combination : fit.undetermined) {
    std::vector<std::string> parts;
    for (const auto& [name, change] : combination.change_percent)
      parts.push_back(fmt::format("{} {:+.2g} %", name, change));
    fmt::print("  not determined: {}{}\n", fmt::join(parts, ", "),
               std::isfinite(combination.sd_percent)
                   ? fmt::format(" together, known to {:.3g} times that only", combination.sd_percent)
                   : " together, which changes nothing that was measured");
  }
  for (const std::string& remark : fit.remarks)
    fmt::print("  {}\n", remark);
}

void print_comparison(const std::vector<BenchTest>& tests, const LawComparison& comparison) {
  for (const BenchTest& test : tests)
    fmt::print("{}: {}, {} readings\n", test.file, test.kind->name, test.readings.size());
  fmt::print("\n{}\n\n  {:<18} {:>10} {:>8} {:>15}", comparison.why, "law", "parameters", "fit (%)",
             "prediction (%)");
  if (comparison.over_kinds) {
    for (const std::string& fold : comparison.folds)
      fmt::print("  {:>16}", fold);
  }
  fmt::print("\n");
  for (const ComparedLaw& law : comparison.laws) {
    fmt::print("  {:<18} {:>10} {:>8} {:>15}", law.fit.law->name(), law.fit.law->parameters().size(),
               law.fit.parameters.empty() ? "-" : percent_words(law.fit.error_percent),
               percent_words(law.predicted_percent));
    for (const LeftOut& left_out : law.left_out) {
      if (comparison.over_kinds)
        fmt::print("  {:>16}", percent_words(left_out.error_percent) + (left_out.determined ? "" : "*"));
    }
    fmt::print("\n");
  }
  fmt::print("  Prediction: {}.\n", comparison.over_kinds
                                        ? "each kind of test by the others; *: which do not determine the law"
                                        : "every fifth reading by the others, for there is one kind of test");
  if (comparison.preferred) print_law(comparison.laws[*comparison.preferred].fit);
}

ExitCode run_law(const LawArguments& arguments, const CommandOutput& out) {
  if (arguments.page) require_output({*arguments.page, arguments.data, report::page_mark, arguments.force});
  std::vector<BenchTest> tests;
  for (auto file = arguments.data.begin(); file != arguments.data.end(); ++file) {
    std::error_code missing;
    const bool twice = std::any_of(arguments.data.begin(), file, [&](const std::filesystem::path& other) {
      return std::filesystem::equivalent(other, *file, missing);
    });
    if (twice)
      throw InputError(
          {file->string(), "", "is given twice", "Data that count twice make errors too small."});
  }
  for (const std::filesystem::path& file : arguments.data)
    tests.push_back(read_bench_test(file));
  const std::vector<const Law*> laws = chosen_laws(arguments, tests);

  const Interruption interruption;
  const auto begun = Clock::now();
  double next_s = 2;
  const LawComparison comparison =
      compare_laws(laws, tests,
                   {[] { return Interruption::requested(); },
                    [&](size_t done, size_t of) {
                      if (seconds_since(begun) < next_s) return;
                      next_s = seconds_since(begun) + 1;
                      fmt::print(stderr, "law: {} of {} fits, {:.0f} s\n", done, of, seconds_since(begun));
                    }});
  if (comparison.laws.empty()) {
    fmt::print(stderr, "{}\n", comparison.why);
    return ExitCode::negative;
  }
  if (arguments.page) {
    report::Page page("Bench tests of tissue");
    report::add_laws(page, tests, comparison);
    write_whole_file(*arguments.page, page.html());
  }
  if (out.json) {
    std::cout << to_json(tests, comparison);
  } else {
    print_comparison(tests, comparison);
    if (arguments.page) fmt::print("\nThe curves are in {}\n", arguments.page->string());
  }
  const bool determined = comparison.preferred && comparison.laws[*comparison.preferred].fit.determined();
  return determined ? ExitCode::done : ExitCode::negative;
}

}  // namespace

void add_law(CommandLine& line) {
  auto arguments = std::make_shared<LawArguments>();
  CLI::App* command = line.add(
      "law", "a material law from bench tests of tissue, and which law predicts them best",
      "  diastole law examples/bench-tests/uniaxial.csv --law neo-hookean\n"
      "  diastole law examples/bench-tests/*.csv -o laws.html\n"
      "  diastole law examples/bench-tests/*.csv --law mooney-rivlin --law my-law.law.toml --json\n\n"
      "DATA.csv, one row a reading; the header names the test:\n"
      "  stretch,nominal_kPa                                            uniaxial\n"
      "  planar_stretch,nominal_kPa                                     a wide strip\n"
      "  stretch_1,stretch_2,nominal_1_kPa,nominal_2_kPa                biaxial\n"
      "  shear,shear_stress_kPa                                         simple shear\n"
      "  cylinder_radius_mm,cylinder_height_mm,axial_stretch,twist_deg,moment_Nmm[,axial_force_N]\n"
      "  "
      "unloaded_inner_radius_mm,unloaded_outer_radius_mm,axial_stretch,outer_radius_mm,pressure_kPa[,axial_"
      "force_N]\n"
      "  inner_radius_mm,outer_radius_mm,height_mm,...                  as `diastole shear` reads it\n"
      "Laws with fibres need a last column fibre_deg. docs/law.md says more.");
  command->add_option("DATA", arguments->data, "bench tests of one material")->required();
  command
      ->add_option(
          "--law", arguments->laws,
          "a built-in law, or a file NAME.law.toml; may be repeated; without it all that these tests can fit")
      ->allow_extra_args(false);
  command->add_option("-o,--output", arguments->page, "a page with the curves, to write");
  command->add_flag("--force", arguments->force, "replace an output file that is no report");
  line.on_run(command, [arguments](const CommandOutput& out) { return run_law(*arguments, out); });
}

}  // namespace diastole
