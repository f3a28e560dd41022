#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/output_files.hpp"
#include "estimator/cli/solution_json.hpp"
#include "estimator/cli/solution_outputs.hpp"
#include "estimator/cli/study_options.hpp"
#include "estimator/cli/unloading_output.hpp"
#include "estimator/fe/elastic_system.hpp"
#include "estimator/fe/point_fields.hpp"
#include "estimator/io/finding_json.hpp"
#include "estimator/io/measurement.hpp"
#include "estimator/io/study.hpp"
#include "estimator/mesh/collapsed_edge.hpp"
#include "estimator/mesh/point_locator.hpp"
#include "estimator/model/affected_model.hpp"
#include "estimator/model/study_model.hpp"
#include "estimator/solution/solution_grid.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/contract/named_members.hpp"
#include "protocol/contract/text.hpp"

namespace diastole {
namespace {

struct SolveArguments {
  StudyOptions study;
  std::optional<double> pressure_kPa;
  std::optional<double> volume_change_mL;
  double fibre_tension_kPa = 0.0;
  bool frames = false;
  std::vector<std::string> probes;
  SolutionOutputs outputs;
};

struct Probe {
  Eigen::Vector3d place_mm;  ///< in the study's shape, imaged or free of stress
  MaterialPoint point;
};

[[noreturn]] void refuse_probe(const std::string& text, std::string problem, std::string remedy) {
  throw InputError({"", "--probe " + text, std::move(problem), std::move(remedy)});
}

Eigen::Vector3d parse_place(const std::string& text) {
  const auto place = parse_numbers<double, 3>(text);
  if (!place || !std::ranges::all_of(*place, [](double x) { return std::isfinite(x); }))
    refuse_probe(text, "is not three numbers X,Y,Z",
                 "Write millimetres without spaces, as --probe 22.5,0,0.");
  return Eigen::Vector3d(place->data());
}

std::vector<Probe> locate_probes(const HermiteMesh& mesh, const std::vector<std::string>& texts) {
  constexpr double surface_slack_xi = 1e-3;  // a point on a wall may lie a few microns outside the cubic arcs
  const PointLocator locator(mesh, mesh.reference(), {.outside_xi = surface_slack_xi, .tolerance_mm = 1e-10});
  std::vector<Probe> probes;
  for (const std::string& text : texts) {
    const Eigen::Vector3d place = parse_place(text);
    const std::optional<LocatedPoint> found = locator.find(place);
    if (!found) {
      refuse_probe(text, "lies outside the undeformed specimen",
                   "Give a material point in mm: the axis is z, mid-height z = 0.");
    }
    probes.push_back({place, found->point});
  }
  return probes;
}

/// Strain and stress at a place by name; null where there is no direction of the wall (a collapsed edge).
nlohmann::ordered_json fields_json(const ElasticModel& model, const ElasticState& state,
                                   const MaterialPoint& point) {
  constexpr double least_relative_volume = 1e-9;
  if (is_collapsed(model.mesh(), point, least_relative_volume)) return nullptr;
  const PointFields fields = point_fields(model.system(), state, point);
  const std::vector<std::string> names = scalar_field_names(fields.fibre.has_value());
  const std::vector<double> values = scalar_fields(fields);
  nlohmann::ordered_json json;
  for (size_t i = 0; i < names.size(); ++i)
    json[names[i]] = values[i];
  return json;
}

nlohmann::ordered_json as_json(const Study& study, ElasticModel& model, const Solution& solution,
                               const std::vector<Probe>& probes, double seconds) {
  const SolveReport& report = solution.report;
  nlohmann::ordered_json json;
  json["reason"] = describe(report.reason);
  add_equilibrium(json, model, solution.state);
  json["fibre_tension_kPa"] = solution.state.fibre_tension_kPa;
  json["law"] = model.law().name();
  for (const StudyParameter& parameter : study.law.parameters)
    json["parameters"][parameter.name] = parameter.start;
  json["mesh"] = mesh_of(study.specimen);
  json["elements"] = model.mesh().element_count();
  json["dofs"] = model.dofs();
  json.update({DIASTOLE_NAMED(report, load_steps, newton_iterations, factorisations, negative_pivots,
                              pressure_unknowns)});
  json["unstable_motions"] = nullptr;
  if (report.unstable_motions) json["unstable_motions"] = *report.unstable_motions;
  json["stable"] = nullptr;
  if (const std::optional<bool> stable = report.stable()) json["stable"] = *stable;
  json["seconds"] = seconds;
  const ElasticState shown = with_averaged_pressure(model.system(), solution.state);
  json["probes"] = nlohmann::ordered_json::array();
  for (const Probe& probe : probes) {
    const Eigen::Vector3d moved = model.mesh().value(solution.state.position_mm, probe.point) -
                                  model.mesh().value(model.mesh().reference(), probe.point);
    json["probes"].push_back({{"point_mm", {probe.place_mm[0], probe.place_mm[1], probe.place_mm[2]}},
                              {"displacement_mm", {moved[0], moved[1], moved[2]}},
                              {"fields", fields_json(model, shown, probe.point)}});
  }
  return json;
}

/// "8 x 4 x 1 = ", or "8 x 4 x 1, refined: " where halving has made more elements of them.
std::string mesh_in_words(const std::vector<int>& mesh, int elements) {
  if (mesh.empty()) return "";
  const bool refined = std::accumulate(mesh.begin(), mesh.end(), 1, std::multiplies<>()) != elements;
  return fmt::format("{}{}", fmt::join(mesh, " x "), refined ? ", refined: " : " = ");
}

nlohmann::ordered_json frames_json(const ElasticModel& model, const std::vector<SolvedFrame>& solved) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  const double rest_mL = model.cavity_volume_mL(model.rest_state());
  for (const SolvedFrame& frame : solved) {
    nlohmann::ordered_json change_mL;
    if (model.system().cavity_closed()) change_mL = model.cavity_volume_mL(frame.state) - rest_mL;
    json.push_back({{"time_s", frame.time_s},
                    {"pressure_kPa", frame.state.pressure_kPa},
                    {"cavity_volume_change_mL", std::move(change_mL)}});
  }
  return json;
}

void print_for_people(const nlohmann::ordered_json& json) {
  const double pressure_kPa = json["pressure_kPa"];
  if (json["cavity_volume_mL"].is_null()) {
    fmt::print("At {:g} kPa. The cavity is open: it has no volume.\n", pressure_kPa);
  } else {
    fmt::print("At {:g} kPa the cavity has taken {:.3f} mL and holds {:.3f} mL.\n", pressure_kPa,
               json["cavity_volume_change_mL"].get<double>(), json["cavity_volume_mL"].get<double>());
  }
  for (const auto& probe : json["probes"]) {
    fmt::print("  X = ({:g}) mm moved by ({:.4f}) mm\n",
               fmt::join(probe["point_mm"].get<std::vector<double>>(), ", "),
               fmt::join(probe["displacement_mm"].get<std::vector<double>>(), ", "));
  }
  const std::vector<int> mesh = json["mesh"].get<std::vector<int>>();
  fmt::print(
      "  {}{} elements, {} unknowns, {} load steps, {} Newton iterations with {} factorisations, {:.2f} s\n",
      mesh_in_words(mesh, json["elements"].get<int>()), json["elements"].get<size_t>(),
      json["dofs"].get<size_t>(), json["load_steps"].get<size_t>(), json["newton_iterations"].get<size_t>(),
      json["factorisations"].get<size_t>(), json["seconds"].get<double>());
  if (json.contains("files"))
    fmt::print("Written: {}\n", fmt::join(json["files"].get<std::vector<std::string>>(), ", "));
}

void require_one_load(const SolveArguments& arguments) {
  const auto refuse = [](std::string place, std::string problem) {
    throw InputError({"", std::move(place), std::move(problem),
                      "Give a pressure, for example --pressure-kPa 6, or the volume that the cavity takes, "
                      "--volume-change-mL 24, or --frames for all of the study's frames."});
  };
  const bool pressure = arguments.pressure_kPa.has_value();
  const bool volume = arguments.volume_change_mL.has_value();
  if (!pressure && !volume && !arguments.frames) refuse("--pressure-kPa", "is missing");
  if (pressure && volume) refuse("--pressure-kPa", "is given beside --volume-change-mL");
  if (pressure && arguments.frames) refuse("--pressure-kPa", "is given beside --frames");
  if (volume && arguments.frames) refuse("--volume-change-mL", "is given beside --frames");
}

void require_fibres_for_tension(const SolveArguments& arguments, const ElasticModel& model) {
  const double tension_kPa = arguments.fibre_tension_kPa;
  const auto refuse = [](std::string problem, std::string remedy) {
    throw InputError({"", "--fibre-tension-kPa", std::move(problem), std::move(remedy)});
  };
  if (tension_kPa < 0.0)
    refuse(fmt::format("{} is not a tension", tension_kPa), "Give zero or more, for example 60.");
  if (tension_kPa > 0.0 && !model.system().material_axes()) {
    refuse("the specimen has no fibres to pull along",
           "Give an ellipsoid, or a mesh file with fibre_deg (docs/mesh-file.md).");
  }
}

struct TimedLoad {
  double time_s;
  Load load;
};

/// The loads to solve for: the one of the command line, or the study's frames.
std::vector<TimedLoad> loads_of(const SolveArguments& arguments, const Study& study,
                                const ElasticModel& model) {
  const double tension_kPa = arguments.fibre_tension_kPa;
  if (arguments.volume_change_mL) {
    require_closed_cavity(study, model);
    const double rest_mL = model.cavity_volume_mL(model.rest_state());
    return {
        {0.0, {.fibre_tension_kPa = tension_kPa, .cavity_volume_mL = rest_mL + *arguments.volume_change_mL}}};
  }
  if (arguments.pressure_kPa != 0.0) require_cavity(study, model);
  if (arguments.pressure_kPa) return {{0.0, {*arguments.pressure_kPa, tension_kPa}}};
  std::vector<TimedLoad> loads;
  for (const Frame& frame : read_frames(*study.data.frames))
    loads.push_back({frame.time_s, {frame.pressure_kPa, tension_kPa}});
  return loads;
}

void require_frames(const SolveArguments& arguments, const Study& study) {
  if (!arguments.frames || study.data.frames) return;
  throw InputError({study.file.string(), "key data.frames",
                    "missing, although --frames asks for the frames' pressures",
                    "Name the file with each frame's pressure: frames = \"NAME.frames.csv\"."});
}

/// Each load from the state of the one before; ends at the first that has no equilibrium.
Solution solve_all(ElasticModel& model, const std::vector<TimedLoad>& loads,
                   std::vector<SolvedFrame>& solved) {
  Solution solution{model.rest_state(), {}};
  for (const TimedLoad& timed : loads) {
    solution = model.solve(timed.load, solution.state);
    if (!solution.report.converged()) break;
    solved.push_back({timed.time_s, with_averaged_pressure(model.system(), solution.state)});
  }
  return solution;
}

void report_failure_or_instability(const SolveArguments& arguments, const SolveReport& report) {
  if (report.converged()) {
    if (report.stable() != false) return;
    const std::string motions = report.singular ? "some motion meets no resistance"
                                                : fmt::format("in {} independent motions it leaves by itself",
                                                              *report.unstable_motions);
    fmt::print(stderr, "diastole solve: this equilibrium is not stable: {}\n", motions);
    return;
  }
  fmt::print(stderr, "diastole solve: {}\n", report.describe());
  constexpr double borne_share = 0.01;  // less than this of what was asked for is a matter of units
  if (arguments.pressure_kPa &&
      std::abs(report.reached_pressure_kPa) < borne_share * std::abs(*arguments.pressure_kPa) &&
      report.reason != SolveReason::singular_tangent) {
    fmt::print(stderr, "  {:g} kPa is far more than this body bears: 1 kPa = 1000 Pa = 7.5 mmHg = 10 mbar.\n",
               *arguments.pressure_kPa);
    return;
  }
  if (arguments.volume_change_mL || report.load_steps == 0) return;
  if (report.reason == SolveReason::limit_point) {
    fmt::print(stderr, "  `diastole pv` leads the volume instead, finds that point and goes on beyond.\n");
  } else if (report.reason != SolveReason::out_of_steps) {
    fmt::print(stderr,
               "  If the pressure has a maximum on the way, `diastole pv` finds it and goes on beyond.\n");
  }
}

ExitCode run_solve(const SolveArguments& arguments, const CommandOutput& out) {
  const Clock::time_point begun = Clock::now();
  require_one_load(arguments);
  const Study study = read_study(arguments.study);
  require_frames(arguments, study);
  arguments.outputs.require(study, arguments.frames);
  std::vector<Finding> findings;
  SolveOptions options = with_progress("solve");
  options.check_stability = true;
  std::optional<UnloadedModel> unloaded;
  std::optional<ElasticModel> as_given;
  if (arguments.study.unload) {
    findings = model_findings(study);  // before a search that takes its time
    print_findings(findings, stderr);
    unloaded = unload(study, options);
  } else {
    as_given = make_model_and_print_findings(study, std::move(options), findings);
    remark_on_imaged_load(study, "solve");
  }
  ElasticModel& model = unloaded ? unloaded->model : *as_given;
  require_fibres_for_tension(arguments, model);
  remark_on_size(model.mesh(), "solve");
  const std::vector<TimedLoad> loads = loads_of(arguments, study, model);
  const std::vector<Probe> probes =
      locate_probes(unloaded ? unloaded->imaged.mesh() : model.mesh(), arguments.probes);
  const bool whole = !unloaded || unloaded->returned();

  std::vector<SolvedFrame> solved;
  const Solution solution = whole ? solve_all(model, loads, solved) : Solution{model.rest_state(), {}};
  const bool done = whole && solution.report.converged();
  nlohmann::ordered_json json = as_json(study, model, solution, probes, seconds_since(begun));
  if (unloaded) json["unloaded"] = unloading_json(*unloaded);
  if (!whole) json["reason"] = "no shape without load";
  json["findings"] = written(findings);
  if (done) {
    arguments.outputs.write(study, model, solved);
    for (const std::filesystem::path& file : arguments.outputs.files.files)
      json["files"].push_back(file.string());
  }
  if (arguments.frames) json["frames"] = frames_json(model, solved);
  if (whole) report_failure_or_instability(arguments, solution.report);
  if (!whole) fmt::print(stderr, "diastole solve: {}\n", unloaded->describe());
  if (out.json) {
    std::cout << json_text(json, 1) << '\n';
  } else if (done) {
    if (unloaded) print_unloading(json["unloaded"], study.imaged_at->pressure_kPa);
    print_for_people(json);
  }
  return done ? ExitCode::done : ExitCode::negative;
}

}  // namespace

void add_solve(CommandLine& line) {
  auto arguments = std::make_shared<SolveArguments>();
  CLI::App* command = line.add(
      "solve", "one forward finite-element solution of a study's specimen at a cavity pressure or volume",
      "  diastole solve phantom-a.study.toml --pressure-kPa 6 --set C1_kPa=6.5\n"
      "  diastole solve phantom-a.study.toml --pressure-kPa 3.1 --probe 22.5,0,0 --probe 50,0,0 --json\n"
      "  diastole solve phantom-a.study.toml --pressure-kPa 6 --mesh 8,8,4 -o gel.vtkhdf -o gel.csv\n"
      "  diastole solve phantom-a.study.toml --volume-change-mL 24\n"
      "  diastole solve lv-clean.study.toml --pressure-kPa 2 --fibre-tension-kPa 10\n"
      "  diastole solve phantom-a.study.toml --frames -o gel.vtkhdf -o gel.xdmf\n"
      "  diastole solve phantom-a.study.toml --pressure-kPa 3.1 -o gel.feb --cells 4,4,4\n"
      "  diastole solve examples/imaged-ventricle.study.toml --unload --pressure-kPa 2\n"
      "A parameter has its `start` value unless --set gives another.\n"
      "Exit code 1: no equilibrium was found; the message says where the solver stopped and why.");
  add_study(*command, arguments->study);
  add_values(*command, arguments->study);
  add_refinement(*command, arguments->study);
  add_unloading(*command, arguments->study);
  command->add_option("--pressure-kPa", arguments->pressure_kPa, "cavity pressure above the outside");
  command->add_option("--volume-change-mL", arguments->volume_change_mL,
                      "volume that the cavity takes, instead of its pressure");
  command->add_option(
      "--fibre-tension-kPa", arguments->fibre_tension_kPa,
      "active tension along the fibres, beside the pressure or volume (second Piola-Kirchhoff)");
  command->add_flag("--frames", arguments->frames,
                    "solve for all frames of the study instead, one after the other");
  command
      ->add_option("--probe", arguments->probes,
                   "X,Y,Z of a material point in mm, in the shape of the study; may be repeated")
      ->allow_extra_args(false);
  arguments->outputs.add_options(*command);
  line.on_run(command, [arguments](const CommandOutput& out) { return run_solve(*arguments, out); });
}

}  // namespace diastole
