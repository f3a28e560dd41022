// `tools/bench rig [folder] [case or kind ...]`: how well the rig's model fits recorded sessions (data/README.md, labels.json).
// A row a case: reduced chi-square of the base model and of the model with the labelled effects, by channel too, the
// effects' parameters with their errors and the truth, simulations and seconds.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "estimator/rig_fit/rig_fit.hpp"
#include "tools/benchmarks/recorded_cases.hpp"

namespace {

using namespace diastole;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Reduced chi-square of each channel over the runs.
std::string by_channel(const rig::RigProblem& problem, const rig::RigFit& fit) {
  std::string text;
  for (const char* channel : {"cavity_kPa", "pump_kPa", "cavity_mL"}) {
    double square = 0.0;
    double count = 0.0;
    for (const rig::ResidualBlock& block : problem.blocks()) {
      if (block.channel != channel) continue;
      square += fit.residuals
                    .segment(static_cast<Eigen::Index>(block.first), static_cast<Eigen::Index>(block.count))
                    .squaredNorm();
      count += static_cast<double>(block.count);
    }
    text += count > 0.0 ? fmt::format(" {:7.3f}", square / count) : "       -";
  }
  return text;
}

/// The labelled effects with their moments; empty if one is not in the library.
std::vector<rig::ModelTerm> labelled(const nlohmann::json& label, const rig::Session& session) {
  const auto change_point = [&](const std::string& run, double time_s) {
    double started_s = 0.0;
    for (const rig::SessionRun& other : session.runs)
      if (other.drive.place.name == run) started_s = other.drive.place.started_s;
    return ChangePoint{run, time_s, started_s + time_s};
  };
  std::vector<rig::ModelTerm> list;
  for (const auto& truth : label["truth"]) {
    const Effect* effect = find_effect(truth["id"].get<std::string>());
    if (effect == nullptr) return {};
    rig::ModelTerm term{effect, {}};
    const auto& parameters = truth["parameters"];
    if (parameters.contains("time_s"))
      term.change_points.push_back(
          change_point(parameters["run"].get<std::string>(), parameters["time_s"].get<double>()));
    if (parameters.contains("events_s")) {
      for (const auto& [run, times] : parameters["events_s"].items())
        for (const double time_s : times)
          term.change_points.push_back(change_point(run, time_s));
    }
    list.push_back(term);
  }
  return list;
}

void report(const bench::RecordedCase& recorded, const Study& study, const rig::SpecimenFamily& family) {
  const nlohmann::json& label = recorded.label;
  const auto begun = std::chrono::steady_clock::now();
  const rig::Session session = rig::read_session(study);
  const rig::RigProblem problem(session, family);
  const rig::NoiseModel& noise = problem.noise();
  std::string kinds;
  for (const auto& truth : label["truth"])
    kinds += fmt::format("{}{}", kinds.empty() ? "" : "+", truth["id"].get<std::string>());
  fmt::print(
      "{} {:11} {:38} d {:8.1f} base {:9.3f} |{} | C1 {:.4f}+-{:.4f} ({:.4f}) off {:.1f} {:.1f} ({:.1f}) "
      "noise {:.1f} cycles {:.2e} ({:.2e}) {:.1f} s\n",
      recorded.name, label["kind"].get<std::string>(), kinds, label["d"].get<double>(),
      problem.base().reduced(), by_channel(problem, problem.base()), problem.base().values[0],
      problem.base().errors[0], label["C1_kPa"].get<double>(), problem.base().values[1],
      problem.base().values[2], label["offset_Pa"].get<double>(),
      1e3 * noise.channels.at(rig::Channel::cavity).sd_kPa, noise.cycle_sd, label["beat_sd"].get<double>(),
      seconds_since(begun));
  const std::vector<rig::ModelTerm> effects = labelled(label, session);
  if (effects.empty()) return;
  const auto second = std::chrono::steady_clock::now();
  const rig::RigFit fit = problem.fit(effects);
  fmt::print("    with {:9.3f} |{} | C1 {:.4f}+-{:.4f}; {} it, {} simulations, {:.1f} s\n", fit.reduced(),
             by_channel(problem, fit), fit.values[0], fit.errors[0], fit.iterations, fit.simulations,
             seconds_since(second));
  for (size_t i = 3; i < fit.values.size(); ++i)
    fmt::print("        {} = {:.6g} +- {:.2g}\n", fit.unknowns[i].name, fit.values[i], fit.errors[i]);
  for (const auto& truth : label["truth"])
    fmt::print("        truth {} {}\n", truth["id"].get<std::string>(), truth["parameters"].dump());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const auto recordings = bench::recordings_of(argc, argv);
  if (!recordings) return 0;
  std::unique_ptr<rig::SpecimenFamily> family;  // all sessions have the same specimen
  bench::visit_cases(*recordings, [&](const bench::RecordedCase& recorded) {
    const Study study = read_study(recorded.study);
    if (!family) family = std::make_unique<rig::SpecimenFamily>(study);
    report(recorded, study, *family);
  });
  return 0;
}
