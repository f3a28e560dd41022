#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/interruption.hpp"
#include "estimator/cli/output_files.hpp"
#include "estimator/cli/solution_json.hpp"
#include "estimator/cli/study_options.hpp"
#include "estimator/fe/pressure_volume.hpp"
#include "estimator/io/finding_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/model/affected_model.hpp"
#include "estimator/model/study_model.hpp"
#include "estimator/report/page.hpp"
#include "estimator/report/svg_plot.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/contract/named_members.hpp"

namespace diastole {
namespace {

constexpr std::string_view csv_header =
    "volume_change_mL,pressure_kPa,stiffness_kPa_per_mL,stored_energy_mJ,stable_at_volume,stable_at_"
    "pressure\n";

struct PvArguments {
  StudyOptions study;
  double volume_change_mL = 0.0;
  size_t steps = 20;
  OutputFiles outputs;
};

bool stable_at_pressure(const PressureVolumePoint& point) {
  return point.stable_at_volume && point.stiffness_kPa_per_mL > 0.0;
}

std::string to_csv(const PressureVolumeCurve& curve) {
  std::string text(csv_header);
  for (const PressureVolumePoint& point : curve.points) {
    fmt::format_to(std::back_inserter(text), "{:.6f},{:.9f},{:.9g},{:.6f},{:d},{:d}\n",
                   point.volume_change_mL, point.pressure_kPa, point.stiffness_kPa_per_mL,
                   point.stored_energy_mJ, point.stable_at_volume, stable_at_pressure(point));
  }
  return text;
}

std::string to_html(const Study& study, const PressureVolumeCurve& curve) {
  using report::numbers_of;
  const auto volume_mL = numbers_of(curve.points, &PressureVolumePoint::volume_change_mL);
  report::SvgPlot plot({.x = {.label = "volume taken (mL)"}, .y = {.label = "cavity pressure (kPa)"}});
  plot.line(volume_mL, numbers_of(curve.points, &PressureVolumePoint::pressure_kPa), "a", "pressure");
  if (!curve.limits.empty()) {
    plot.points(numbers_of(curve.limits, &LimitPoint::volume_change_mL),
                numbers_of(curve.limits, &LimitPoint::pressure_kPa), "b", "limit point");
  }
  report::SvgPlot slope({.x = {.label = "volume taken (mL)"}, .y = {.label = "dP/dV (kPa/mL)"}});
  slope.line(volume_mL, numbers_of(curve.points, &PressureVolumePoint::stiffness_kPa_per_mL), "c");
  report::Page page("Pressure-volume curve");
  page.section(study.file.filename().string(),
               fmt::format("Law {}; the cavity's volume is led, its pressure found.", study.law.name));
  if (!curve.last.converged()) page.warning("The curve ends early: " + curve.last.describe());
  page.figures(
      {{plot.svg(), "Pressure against the volume that the cavity has taken."},
       {slope.svg(), "Stiffness of the cavity. Below zero no equilibrium is stable at given pressure."}});
  const auto row_of = [](const PressureVolumePoint& point) -> report::Page::Row {
    return {fmt::format("{:.2f}", point.volume_change_mL), fmt::format("{:.4f}", point.pressure_kPa),
            fmt::format("{:.5f}", point.stiffness_kPa_per_mL), fmt::format("{:.2f}", point.stored_energy_mJ),
            stable_at_pressure(point) ? "yes" : "no"};
  };
  page.table_of(
      curve.points,
      {"volume taken (mL)", "pressure (kPa)", "dP/dV (kPa/mL)", "stored (mJ)", "stable at pressure"}, row_of,
      "Points of the curve.");
  return page.html();
}

nlohmann::ordered_json to_json(const Study& study, ElasticModel& model, const PressureVolumeCurve& curve,
                               const std::vector<Finding>& findings, double seconds) {
  nlohmann::ordered_json json;
  json["reason"] = Interruption::requested() ? std::string_view("interrupted") : describe(curve.last.reason);
  json["law"] = model.law().name();
  for (const StudyParameter& parameter : study.law.parameters)
    json["parameters"][parameter.name] = parameter.start;
  json["mesh"] = mesh_of(study.specimen);
  json["dofs"] = model.dofs();
  json["points"] = nlohmann::ordered_json::array();
  for (const PressureVolumePoint& point : curve.points) {
    json["points"].push_back({DIASTOLE_NAMED(point, volume_change_mL, pressure_kPa, stiffness_kPa_per_mL,
                                             stored_energy_mJ, stable_at_volume),
                              {"stable_at_pressure", stable_at_pressure(point)},
                              DIASTOLE_NAMED(point, newton_iterations)});
  }
  json["limit_points"] = nlohmann::ordered_json::array();
  for (const LimitPoint& limit : curve.limits)
    json["limit_points"].push_back({DIASTOLE_NAMED(limit, volume_change_mL, pressure_kPa)});
  json["work_mJ"] = curve.work_mJ();
  add_equilibrium(json["end"], model, curve.state);
  json["findings"] = written(findings);
  json["seconds"] = seconds;
  return json;
}

/// Rounding errors of a zero are shown as one.
double shown(double value) { return std::abs(value) < 1e-9 ? 0.0 : value; }

void print_for_people(const PressureVolumeCurve& curve) {
  fmt::print("  volume (mL)  pressure (kPa)  dP/dV (kPa/mL)  stored (mJ)\n");
  for (const PressureVolumePoint& point : curve.points) {
    fmt::print("{:>13.3f}{:>16.4f}{:>16.5f}{:>13.2f}{}\n", point.volume_change_mL, shown(point.pressure_kPa),
               point.stiffness_kPa_per_mL, shown(point.stored_energy_mJ),
               !point.stable_at_volume      ? "  not stable"
               : !stable_at_pressure(point) ? "  stable only at held volume"
                                            : "");
  }
  for (const LimitPoint& limit : curve.limits)
    fmt::print("Limit point: {:.4f} kPa at {:.2f} mL.\n", limit.pressure_kPa, limit.volume_change_mL);
}

ExitCode run_pv(const PvArguments& arguments, const CommandOutput& out) {
  const Clock::time_point begun = Clock::now();
  if (arguments.volume_change_mL == 0.0) {
    throw InputError({"", "--volume-change-mL",
                      fmt::format("{} is no volume to go to", arguments.volume_change_mL),
                      "Give the mL that the cavity takes, for example 60; less than zero empties it."});
  }
  constexpr std::array outputs{OutputKind{".html", report::page_mark},
                               OutputKind{".csv", csv_header.substr(0, csv_header.size() - 1)}};
  arguments.outputs.require({arguments.study.study}, outputs, "is neither .html nor .csv",
                            "Name the page or the table to write, for example curve.html.");
  const Study study = read_study(arguments.study);
  remark_on_imaged_load(study, "pv");
  std::vector<Finding> findings;
  ElasticModel model = make_model_and_print_findings(study, with_progress("pv"), findings);
  require_closed_cavity(study, model);
  remark_on_size(model.mesh(), "pv");
  const Interruption interruption;
  PressureVolumeOptions options{.volume_change_mL = arguments.volume_change_mL, .steps = arguments.steps};
  options.on_point = [&](const PressureVolumePoint& point) {
    fmt::print(stderr, "pv: {:.3g} mL, {:.4g} kPa\n", point.volume_change_mL, point.pressure_kPa);
    return !Interruption::requested();
  };
  const PressureVolumeCurve curve = pressure_volume_curve(model, options);
  for (const std::filesystem::path& output : arguments.outputs.files)
    write_whole_file(output, output.extension() == ".html" ? to_html(study, curve) : to_csv(curve));
  if (!curve.last.converged()) std::cerr << "diastole pv: " << curve.last.describe() << '\n';
  if (Interruption::requested())
    std::cerr << "diastole pv: interrupted; what was found until then is reported\n";
  if (out.json) {
    std::cout << json_text(to_json(study, model, curve, findings, seconds_since(begun)), 1) << '\n';
  } else {
    print_for_people(curve);
    for (const std::filesystem::path& output : arguments.outputs.files)
      fmt::print("The curve is in {}\n", output.string());
  }
  return curve.last.converged() && !Interruption::requested() ? ExitCode::done : ExitCode::negative;
}

}  // namespace

void add_pressure_volume(CommandLine& line) {
  auto arguments = std::make_shared<PvArguments>();
  CLI::App* command =
      line.add("pv", "the pressure-volume curve of a study's specimen, over pressure maxima too",
               "  diastole pv phantom-a.study.toml --volume-change-mL 60 -o curve.html -o curve.csv\n"
               "  diastole pv heart.study.toml --volume-change-mL 40 --steps 40 --json\n"
               "The cavity's volume is led in equal steps and its pressure found, so that the curve goes on "
               "where the pressure falls.\n"
               "Ctrl-C ends it after the point at hand; what was found is written. Exit code 1: the curve "
               "ends early.");
  add_study(*command, arguments->study);
  add_values(*command, arguments->study);
  add_refinement(*command, arguments->study);
  command
      ->add_option("--volume-change-mL", arguments->volume_change_mL,
                   "volume that the cavity takes at the end")
      ->required();
  command->add_option("--steps", arguments->steps, "equal steps of volume")
      ->check(number_between(1, 10000))
      ->capture_default_str();
  arguments->outputs.add_options(*command, "page (.html) or table (.csv) to write");
  line.on_run(command, [arguments](const CommandOutput& out) { return run_pv(*arguments, out); });
}

}  // namespace diastole
