#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/study_images.hpp"
#include "estimator/cli/study_options.hpp"
#include "estimator/montecarlo/imaging_design.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"

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
  std::cout << json_text(json, 1) << '\n';
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

struct DesignArguments {
  StudyOptions study;
  bool images = false;
  ImagingPlan plan;
};

DesignStudy explored(const DesignArguments& arguments, Study& study) {
  if (!arguments.images) {
    use_images(study);
    return explore_design(study, read_measurement(study), arguments.study.unload);
  }
  if (!study.data.frames)
    throw InputError({study.file.string(), "table [data]",
                      "names no frames: when images are taken is not known",
                      "Add frames = \"NAME.frames.csv\": time and expected pressure of each phase."});
  return explore_imaging(study, read_frames(*study.data.frames), arguments.plan, arguments.study.unload);
}

ExitCode run_design(const DesignArguments& arguments, const CommandOutput& out) {
  Study study = read_study(arguments.study);
  if (!arguments.study.unload) remark_on_imaged_load(study, "design");
  const DesignStudy design = explored(arguments, study);
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
  auto arguments = std::make_shared<DesignArguments>();
  CLI::App* command = line.add(
      "design", "which frame, pressure, tag spacing or images would tell a study's parameters best",
      "  diastole design examples/phantom-a.study.toml\n"
      "  diastole design gel.study.toml --images --short-axis -15,15 --long-axis 0 --snr 15\n"
      "  diastole design lv.study.toml --set C_kPa=3 --set b1=11 --json\n"
      "Predictions hold at the study's start values, or at those of --set. `region` is the size\n"
      "of the joint confidence region as a share of the present one. With --images nothing need be measured "
      "yet:\n"
      "the study's frames say when images are taken and at what pressure, options what they are like.");
  add_study(*command, arguments->study);
  add_values(*command, arguments->study);
  add_unloading(*command, arguments->study);
  ImagingPlan& plan = arguments->plan;
  CLI::Option* images = command->add_flag("--images", arguments->images, "plan tagged images");
  const auto of_images = [&](CLI::Option* option) { return option->needs(images); };
  of_images(command->add_option("--short-axis", plan.short_axis_mm, "heights of slices across the axis, mm"))
      ->delimiter(',')
      ->expected(0, 64);
  of_images(command->add_option("--long-axis", plan.long_axis_deg,
                                "slices along the axis, turned so many degrees from x"))
      ->delimiter(',')
      ->expected(0, 64);
  of_images(command->add_option("--tag-spacing", plan.tag_spacing_mm, "mm"))->check(positive_number);
  of_images(command->add_option("--pixel", plan.pixel_mm, "mm"))->check(positive_number);
  of_images(command->add_option("--snr", plan.snr, "signal of tissue over the noise of one channel"))
      ->check(positive_number);
  of_images(command->add_option("--T1", plan.T1_s, "of tissue, s"))->check(positive_number);
  line.on_run(command, [arguments](const CommandOutput& out) { return run_design(*arguments, out); });
}

}  // namespace diastole
