#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <sstream>

#include "estimator/cli/interruption.hpp"
#include "estimator/cli/study_options.hpp"
#include "estimator/io/measurement.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/model/affected_model.hpp"
#include "estimator/model/study_model.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "tools/diastole/commands.hpp"
#include "tools/sim_scanner/diffusion_scan.hpp"
#include "tools/sim_scanner/phase_contrast_scan.hpp"
#include "tools/sim_scanner/scanner.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;
using scanner::ScanPhase;

/// The paper's transducer.
constexpr double usual_sigma_kPa = 0.02;

struct ScanArguments {
  StudyOptions study;
  fs::path folder;
  scanner::ScanProtocol protocol;
  std::optional<double> peak_kPa;
  int phases = 16;
  std::optional<double> period_s;
  bool flow = false;
  double bore_mm = 16.0, venc_cm_s = 120.0;
  bool diffusion = false;
  [[nodiscard]] double cycle_s() const { return period_s.value_or(1.2); }
  double first_s = 0.012;

  [[nodiscard]] double period_of(const std::vector<ScanPhase>& schedule) const {
    if (peak_kPa || period_s || schedule.size() < 2) return cycle_s();
    const double last_s = schedule.back().time_s;
    return last_s + (last_s - schedule.front().time_s) / static_cast<double>(schedule.size() - 1);
  }
};

/// The phases of the study's schedule: the loaded frames of its frames file, or a parabolic cycle up to a pressure.
std::vector<ScanPhase> phases_of(const ScanArguments& arguments, const Study& study) {
  std::vector<ScanPhase> phases;
  if (arguments.peak_kPa) {
    for (int k = 0; k < arguments.phases; ++k) {
      const double time_s =
          arguments.first_s + (arguments.cycle_s() - arguments.first_s) * k / arguments.phases;
      // The parabolic profile: constant acceleration, -constant, constant.
      const double share =
          2 * std::abs(time_s / arguments.cycle_s() - std::round(time_s / arguments.cycle_s()));
      const double done = share < 0.5 ? 2 * share * share : 1 - 2 * (1 - share) * (1 - share);
      phases.push_back({time_s, *arguments.peak_kPa * done});
    }
    return phases;
  }
  if (!study.data.frames)
    throw InputError({study.file.string(), "table [data]", "names no frames: there is no pressure to scan at",
                      "Give --peak-kPa P for a parabolic cycle, or frames = \"NAME.frames.csv\"."});
  for (const Frame& frame : read_frames(*study.data.frames))
    phases.push_back({frame.time_s, frame.pressure_kPa});
  phases.erase(phases.begin());
  if (phases.empty())
    throw InputError({study.data.frames->string(), "", "has no frame but frame 0", "Add the loaded frames."});
  return phases;
}

scanner::ScanPose pose_of(const Study& study) {
  scanner::ScanPose pose;
  if (!study.data.to_specimen) return pose;
  for (Eigen::Index i = 0; i < 3; ++i) {
    pose.origin_mm[i] = study.data.to_specimen->origin_mm[static_cast<size_t>(i)];
    for (Eigen::Index k = 0; k < 3; ++k)
      pose.axes(k, i) = study.data.to_specimen->axes[static_cast<size_t>(i)][static_cast<size_t>(k)];
  }
  return pose;
}

/// Of the undeformed body.
struct Extent {
  double radius_mm = 0, low_mm = 1e300, high_mm = -1e300;
  explicit Extent(const HermiteMesh& mesh) {
    for (size_t node = 0; node < mesh.node_count(); ++node) {
      const double* place = &mesh.reference()[dof_of(node, 0, 0)];
      radius_mm = std::max(radius_mm, std::hypot(place[0], place[1]));
      low_mm = std::min(low_mm, place[2]);
      high_mm = std::max(high_mm, place[2]);
    }
  }
};

/// Before anything is computed.
void check(const ScanArguments& arguments, const ElasticModel& model, const std::vector<ScanPhase>& phases) {
  const scanner::ScanProtocol& protocol = arguments.protocol;
  const double pixel_mm = protocol.field_of_view_mm / protocol.matrix;
  if (protocol.tags.spacing_mm < 3 * pixel_mm)
    throw InputError(
        {"", "--tag-spacing",
         fmt::format("{:g} mm is less than three pixels of {:.3g} mm", protocol.tags.spacing_mm, pixel_mm),
         "Space the tags farther apart, or give a larger --matrix."});
  if (const double period_s = arguments.period_of(phases);
      !(period_s > std::max(arguments.first_s, phases.back().time_s)))
    throw InputError({"", "--period",
                      fmt::format("{:g} s does not hold the phases, from {:g} to {:g} s", period_s,
                                  phases.front().time_s, phases.back().time_s),
                      "Give the time from trigger to trigger."});
  if (!protocol.tagged && !protocol.cine && !arguments.flow && !arguments.diffusion)
    throw InputError(
        {"", "--no-tags", "leaves nothing to scan", "Ask for --cine, --flow or --diffusion too."});
  if (arguments.diffusion && !model.system().material_axes())
    throw InputError({"", "--diffusion", "the study's specimen has no fibres", "Leave it out."});
  if (protocol.short_axis_mm.empty() && protocol.long_axis_deg.empty())
    throw InputError({"", "--short-axis, --long-axis", "no slice is left", "Give at least one."});
  const Extent body(model.mesh());
  if (protocol.field_of_view_mm < 2.1 * body.radius_mm)
    throw InputError({"", "--fov",
                      fmt::format("{:g} mm does not hold a specimen of {:.3g} mm across",
                                  protocol.field_of_view_mm, 2 * body.radius_mm),
                      fmt::format("Give {:.0f} mm or more.", std::ceil(2.3 * body.radius_mm))});
  for (const double z_mm : protocol.short_axis_mm)
    if (z_mm <= body.low_mm || z_mm >= body.high_mm)
      throw InputError(
          {"", "--short-axis",
           fmt::format("a slice at {:g} mm does not cut the specimen, which reaches from {:.3g} to {:.3g} mm",
                       z_mm, body.low_mm, body.high_mm),
           "Give heights between them."});
  const double height_mm = body.high_mm - body.low_mm;
  if (!protocol.long_axis_deg.empty() && protocol.field_of_view_mm < 1.05 * height_mm)
    throw InputError({"", "--fov",
                      fmt::format("{:g} mm does not hold a specimen of {:.3g} mm along its axis",
                                  protocol.field_of_view_mm, height_mm),
                      fmt::format("Give {:.0f} mm or more.", std::ceil(1.15 * height_mm))});
  std::error_code error;
  if (fs::exists(arguments.folder, error) &&
      !(fs::is_directory(arguments.folder, error) && fs::is_empty(arguments.folder, error)))
    throw InputError(
        {arguments.folder.string(), "-o", "is there already and not empty", "Name a new folder."});
}

struct ScanInterrupted {};

/// Becomes the folder that was asked for once it is finished, and vanishes otherwise.
class UnfinishedFolder {
 public:
  explicit UnfinishedFolder(const fs::path& wanted) : wanted_(fs::absolute(wanted).lexically_normal()) {
    if (!wanted_.has_filename()) wanted_ = wanted_.parent_path();  // `trial/`
    std::string name = wanted_.string() + ".XXXXXX";
    if (::mkdtemp(name.data()) == nullptr)
      throw InputError({wanted.string(), "-o", fmt::format("cannot be made: {}", std::strerror(errno)),
                        "Name a folder in one that is there and that you may write to."});
    path_ = name;
    fs::permissions(path_, fs::perms(0755));
  }
  ~UnfinishedFolder() {
    std::error_code gone;
    fs::remove_all(path_, gone);
  }
  UnfinishedFolder(const UnfinishedFolder&) = delete;
  UnfinishedFolder& operator=(const UnfinishedFolder&) = delete;

  [[nodiscard]] const fs::path& path() const { return path_; }
  void finish() {
    fs::remove(wanted_);
    fs::rename(path_, wanted_);
  }

 private:
  fs::path wanted_, path_;
};

/// Of all phases.
struct Motion {
  std::vector<NodeField> position_mm;
  std::vector<double> cavity_mL;  ///< more than at rest
};

Motion motion_of(const Study& study, ElasticModel& model, const std::vector<ScanPhase>& phases) {
  Motion motion;
  ElasticState state = model.rest_state();  // each phase is found from the last
  const double rest_mL = model.cavity_volume_mL(state);
  for (const ScanPhase& phase : phases) {
    if (Interruption::requested()) throw ScanInterrupted{};
    const Solution solution = model.solve(phase.pressure_kPa, state);
    if (!solution.report.converged())
      throw InputError({study.file.string(), fmt::format("pressure {:.3g} kPa", phase.pressure_kPa),
                        solution.report.describe(), "Give other values with --set, or lower pressures."});
    state = solution.state;
    motion.position_mm.push_back(state.position_mm);
    motion.cavity_mL.push_back(model.cavity_volume_mL(state) - rest_mL);
  }
  return motion;
}

/// The flow through a tube above the specimen that makes its cavity's volume; its slice looks into the specimen.
std::vector<scanner::ScannedSeries> scan_flow(const ScanArguments& arguments, const scanner::MovingBody& body,
                                              const std::vector<double>& cavity_mL,
                                              const scanner::ScanPose& pose, int first_series,
                                              const fs::path& folder) {
  scanner::FlowPhantom phantom{.bore_mm = arguments.bore_mm, .period_s = body.period_s};
  phantom.follow(body.times_s, cavity_mL);
  constexpr double above_mm = 30;
  const scanner::PhaseContrastProtocol protocol{
      .phases = 24,
      .venc_cm_s = arguments.venc_cm_s,
      .snr = arguments.protocol.snr,
      .along_row = pose.axes.col(0),
      .along_column = -pose.axes.col(1),
      .middle_mm = pose.origin_mm + pose.axes * Eigen::Vector3d(0, 0, Extent(*body.mesh).high_mm + above_mm),
      .first_series = first_series,
      .seed = arguments.protocol.seed};
  scanner::scan_flow(phantom, protocol, folder);
  const auto files = static_cast<size_t>(protocol.phases);
  return {{first_series, "magnitude of phase contrast", "SA", {}, files},
          {first_series + 1, "velocity", "SA", {}, files}};
}

/// The flow is made of the whole cycle's volume.
void check_cycle(const ScanArguments& arguments, const scanner::MovingBody& body) {
  const std::vector<double>& times_s = body.times_s;
  double gap_s = body.period_s - (times_s.back() - times_s.front());
  bool is_one = gap_s > 0;
  for (size_t k = 1; k < times_s.size(); ++k)
    gap_s = std::max(gap_s, times_s[k] - times_s[k - 1]);
  is_one &= times_s.size() > 2 && gap_s < 2 * body.period_s / static_cast<double>(times_s.size());
  if (!is_one)
    throw InputError({arguments.study.study.string(), "--flow",
                      fmt::format("the frames do not go through a cycle of {:g} s", body.period_s),
                      "Give frames of the whole cycle, some ten or more, and its --period."});
}

/// The study once more, with the scan as its data.
std::string study_text(const Study& study) {
  toml::table root = toml::parse_file(study.file.string());
  root.insert_or_assign("data", toml::table{{"images", "dicom"}, {"frames", "scan.frames.csv"}});
  root.erase("images");
  if (const auto* mesh = std::get_if<MeshSpecimen>(&study.specimen))
    root["specimen"].as_table()->insert_or_assign("mesh_file", fs::absolute(mesh->file).string());
  std::ostringstream text;
  text << root << '\n';
  return text.str();
}

std::string frames_text(const std::vector<ScanPhase>& phases, unsigned seed) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> noise_kPa(0, usual_sigma_kPa);
  std::string text = fmt::format("frame,time_s,pressure_kPa,sigma_kPa\n0,0,0,{:g}\n", usual_sigma_kPa);
  for (size_t k = 0; k < phases.size(); ++k)
    text += fmt::format("{},{:.4f},{:.4f},{:g}\n", k + 1, phases[k].time_s,
                        phases[k].pressure_kPa + noise_kPa(engine), usual_sigma_kPa);
  return text;
}

std::string pose_text(const Study& study, const scanner::ScanPose& pose) {
  const auto row = [](const Eigen::Vector3d& v) {
    return fmt::format("[{:.9f}, {:.9f}, {:.9f}]", v.x(), v.y(), v.z());
  };
  return fmt::format(
      "# x_patient = origin + X x_axis + Y y_axis + Z z_axis\nkind = \"{}\"\norigin_mm = {}\nx_axis = "
      "{}\ny_axis = {}\nz_axis = {}\n",
      std::holds_alternative<AnnulusSpecimen>(study.specimen) ? "annulus" : "ventricle", row(pose.origin_mm),
      row(pose.axes.col(0)), row(pose.axes.col(1)), row(pose.axes.col(2)));
}

void report_series(const ScanArguments& arguments, const std::vector<scanner::ScannedSeries>& series,
                   const CommandOutput& out) {
  size_t files = 0;
  for (const scanner::ScannedSeries& one : series)
    files += one.files;
  if (out.json) {
    nlohmann::ordered_json json{
        {"folder", arguments.folder.string()}, {"files", files}, {"seed", arguments.protocol.seed}};
    json["series"] = nlohmann::ordered_json::array();
    for (const scanner::ScannedSeries& one : series)
      json["series"].push_back({{"number", one.number},
                                {"kind", one.kind},
                                {"view", one.view},
                                {"tag_angles_deg", one.angles_deg},
                                {"files", one.files}});
    std::cout << json_text(json, 1) << '\n';
    return;
  }
  for (const scanner::ScannedSeries& one : series)
    fmt::print(
        "Series {}: {}, {}{}, {} files\n", one.number, one.kind, one.view,
        one.angles_deg.empty() ? "" : fmt::format(", tags {:g} degrees", fmt::join(one.angles_deg, " and ")),
        one.files);
  fmt::print("\n{} files are in {}. What they tell:\n  diastole fit {}\n", files,
             (arguments.folder / "dicom").string(), (arguments.folder / "scan.study.toml").string());
}

ExitCode scan_study(const ScanArguments& arguments, const CommandOutput& out) {
  const Study study = read_study(arguments.study);
  remark_on_imaged_load(study, "scan");
  const std::vector<ScanPhase> phases = phases_of(arguments, study);
  ElasticModel model = make_affected_model(study);
  require_cavity(study, model);
  check(arguments, model, phases);
  UnfinishedFolder unfinished(arguments.folder);
  const fs::path& partial = unfinished.path();
  const bool shows_progress = isatty(STDERR_FILENO) != 0;
  if (shows_progress) fmt::print(stderr, "Solving {} phases.\n", phases.size());
  Motion motion = motion_of(study, model, phases);
  scanner::MovingBody body{&model.mesh(), {}, std::move(motion.position_mm), 0};
  for (const ScanPhase& phase : phases)
    body.times_s.push_back(phase.time_s);
  body.period_s = arguments.period_of(phases);
  if (arguments.flow) check_cycle(arguments, body);
  fs::create_directories(partial / "dicom");
  const scanner::ScanPose pose = pose_of(study);
  scanner::ScanProtocol protocol = arguments.protocol;
  protocol.middle_mm = 0.5 * (Extent(model.mesh()).low_mm + Extent(model.mesh()).high_mm);
  std::vector<scanner::ScannedSeries> series =
      scanner::scan(body, protocol, pose, partial / "dicom", [&](size_t done, size_t all) {
        if (Interruption::requested()) throw ScanInterrupted{};
        if (shows_progress) fmt::print(stderr, "\r{} of {} images{}", done, all, done == all ? "\n" : "");
      });
  // Two scans of one heart, of other series each, then make one export.
  const auto series_from = [&](int number) {
    return series.empty() ? number : std::max(number, series.back().number + 1);
  };
  if (arguments.flow) {
    for (scanner::ScannedSeries& one :
         scan_flow(arguments, body, motion.cavity_mL, pose, series_from(101), partial / "dicom"))
      series.push_back(std::move(one));
  }
  if (arguments.diffusion) {
    const scanner::FibreAt fibre = [&](const MaterialPoint& point) -> Eigen::Vector3d {
      return model.system().material_axes()(model.mesh(), point).col(0);
    };
    series.push_back(scanner::scan_diffusion(
        model.mesh(), fibre,
        {.snr = arguments.protocol.snr, .series = series_from(201), .seed = arguments.protocol.seed}, pose,
        partial / "dicom"));
  }
  write_whole_file(partial / "scan.frames.csv", frames_text(phases, arguments.protocol.seed));
  write_whole_file(partial / "scan.pose.toml", pose_text(study, pose));
  write_whole_file(partial / "scan.study.toml", study_text(study));
  if (Interruption::requested()) throw ScanInterrupted{};
  unfinished.finish();
  report_series(arguments, series, out);
  return ExitCode::done;
}

ExitCode run_scan(const ScanArguments& arguments, const CommandOutput& out) {
  const Interruption interruption;
  try {
    return scan_study(arguments, out);
  } catch (const ScanInterrupted&) {
    std::cerr << "diastole scan: interrupted; nothing was written\n";
    return ExitCode::negative;
  }
}

void add_protocol(CLI::App& command, scanner::ScanProtocol& protocol) {
  command.add_option("--short-axis", protocol.short_axis_mm, "heights of slices across the axis, mm")
      ->delimiter(',')
      ->expected(0, 64);
  command
      .add_option("--long-axis", protocol.long_axis_deg,
                  "slices along the axis, turned so many degrees from x")
      ->delimiter(',')
      ->expected(0, 64);
  command.add_option("--fov", protocol.field_of_view_mm, "field of view, mm")
      ->check(positive_number)
      ->capture_default_str();
  command.add_option("--matrix", protocol.matrix, "pixels each way")
      ->check(number_between(32, 512))
      ->capture_default_str();
  command.add_option("--acquired", protocol.acquired, "share of the phase-encoding lines that is measured")
      ->check(number_between(0.3, 1.0))
      ->capture_default_str();
  command.add_option("--thickness", protocol.thickness_mm, "of a slice, mm")
      ->check(positive_number)
      ->capture_default_str();
  command.add_option("--tag-spacing", protocol.tags.spacing_mm, "mm")
      ->check(positive_number)
      ->capture_default_str();
  command.add_option("--tag-angles", protocol.tags.angles_deg, "of the tags' normals from the rows, degrees")
      ->delimiter(',')
      ->expected(1, 8);
  command
      .add_option("--tag-pulses", protocol.tags.weights,
                  "flip angles in proportion: 1,1 or binomial, as 1,3,3,1")
      ->delimiter(',')
      ->expected(2, 8)
      ->check(positive_number);
  command.add_flag("--grid", protocol.tags.grid, "all directions in one image");
  command.add_option("--snr", protocol.snr, "signal of tissue over the noise of one channel")
      ->check(positive_number)
      ->capture_default_str();
  command.add_option("--T1", protocol.T1_s, "of tissue, s")->check(positive_number)->capture_default_str();
  command.add_option("--shading", protocol.shading, "of the coils, from corner to corner")
      ->check(number_between(0.0, 1.0))
      ->capture_default_str();
  command.add_flag("--cine", protocol.cine, "series without tags, too");
  command.add_flag("--dark-bath", protocol.dark_bath,
                   "what the specimen hangs in gives no signal: `diastole lv` finds the walls of such cines");
}

}  // namespace

void add_scan(CommandLine& line) {
  auto arguments = std::make_shared<ScanArguments>();
  CLI::App* command = line.add(
      "scan", "a simulated scanner: DICOM of a study's motion, to plan a scan or to close the loop",
      "  diastole scan examples/phantom-a.study.toml --set C1_kPa=8.7 -o scan\n"
      "  diastole fit scan/scan.study.toml\n"
      "  diastole scan gel.study.toml --peak-kPa 3 --snr 10 --short-axis -20,0,20 --long-axis 0,90 -o trial\n"
      "The body moves as the study's model says at its start values (or --set), through the pressures of its "
      "frames, which\n"
      "are the scanner's phases; --peak-kPa gives a parabolic cycle instead. Tags are laid at time 0 in the "
      "undeformed body. FOLDER\n"
      "gets dicom/, the pressures with noise (scan.frames.csv), the pose, and a study of them. "
      "docs/imaging.md says what is simulated.");
  ScanArguments& a = *arguments;
  add_study(*command, a.study);
  add_values(*command, a.study);
  command->add_option("-o,--output", a.folder, "the folder to make")->required();
  add_protocol(*command, a.protocol);
  command->add_flag(
      "--flow", a.flow,
      "phase contrast of the tube that fills the specimen, too; the frames must go through a whole cycle");
  command->add_option("--bore", a.bore_mm, "of that tube, mm")
      ->check(number_between(4.0, 40.0))
      ->capture_default_str();
  command->add_option("--venc", a.venc_cm_s, "of the phase contrast, cm/s")
      ->check(positive_number)
      ->capture_default_str();
  command->add_flag("--diffusion", a.diffusion, "diffusion weighted images of the fibres at rest, too");
  command->add_flag("!--no-tags", a.protocol.tagged, "no tagged series");
  command
      ->add_option("--peak-kPa", a.peak_kPa,
                   "a parabolic cycle up to this pressure, instead of the study's frames")
      ->check(positive_number);
  command->add_option("--phases", a.phases, "of that cycle")
      ->check(number_between(1, 64))
      ->capture_default_str();
  command
      ->add_option("--period", a.period_s,
                   "of the cycle, s: 1.2 for a parabolic one, else what the frames span")
      ->check(positive_number);
  command->add_option("--seed", a.protocol.seed, "of the noise and of where the tags lie")
      ->capture_default_str();
  line.on_run(command, [arguments](const CommandOutput& out) { return run_scan(*arguments, out); });
}

}  // namespace diastole
