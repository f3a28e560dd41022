#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/study_options.hpp"
#include "estimator/montecarlo/design.hpp"

namespace diastole {
namespace {

void print_json(const DesignStudy& design, const Study& study) {
  const auto errors = [&](const std::vector<double>& se_percent) {
    nlohmann::ordered_json json;
    for (size_t i = 0; i < se_percent.size(); ++i)
      json[design.parameters[i]] = se_percent[i];
    return json;
  };
  nlohmann::ordered_json json{{"study", study.file.string()}};
  json["values"] = errors(design.values);
  json["se_percent"] = errors(design.se_percent);
  json["options"] = nlohmann::ordered_json::array();
  for (const DesignOption& option : design.options) {
    json["options"].push_back(
        {{"change", option.change}, {"se_percent", errors(option.se_percent)}, {"volume", option.volume}});
  }
  std::cout << json.dump(1) << '\n';
}

/// For each parameter the change that shrinks its interval most.
void print_best(const DesignStudy& design) {
  for (size_t i = 0; i < design.parameters.size(); ++i) {
    const auto best = std::min_element(
        design.options.begin(), design.options.end(),
        [&](const DesignOption& a, const DesignOption& b) { return a.se_percent[i] < b.se_percent[i]; });
    fmt::print("{}: known to {:.2g} % now; {} would make it {:.2g} %.\n", design.parameters[i],
               design.se_percent[i], best->change, best->se_percent[i]);
  }
}

ExitCode run_design(const StudyOptions& options, const CommandOutput& out) {
  const Study study = read_study(options);
  const DesignStudy design = explore_design(study, read_measurement(study));
  if (out.json) {
    print_json(design, study);
    return ExitCode::done;
  }
  fmt::print(
      "Standard errors in %, predicted; changes from the best to the worst for all parameters together\n\n");
  fmt::print("  {:<58}", "change");
  for (const std::string& name : design.parameters)
    fmt::print("  {:>8}", name);
  fmt::print("  region\n  {:<58}", "none");
  for (const double se_percent : design.se_percent)
    fmt::print("  {:>8.2f}", se_percent);
  fmt::print("  1\n");
  for (const DesignOption& option : design.options) {
    fmt::print("  {:<58}", option.change);
    for (const double se_percent : option.se_percent)
      fmt::print("  {:>8.2f}", se_percent);
    fmt::print("  {:.2g}\n", option.volume);
  }
  fmt::print("\n");
  print_best(design);
  return ExitCode::done;
}

}  // namespace

void add_design(CommandLine& line) {
  auto options = std::make_shared<StudyOptions>();
  CLI::App* command =
      line.add("design", "which frame, pressure or tag spacing would tell a study's parameters best",
               "  diastole design examples/phantom-a.study.toml\n"
               "  diastole design lv.study.toml --set C_kPa=3 --set b1=11 --json\n"
               "Predictions hold at the study's start values, or at those of --set. `region` is the size\n"
               "of the joint confidence region as a share of the present one.");
  add_study(*command, *options);
  add_values(*command, *options);
  line.on_run(command, [options](const CommandOutput& out) { return run_design(*options, out); });
}

}  // namespace diastole
