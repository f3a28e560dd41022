// `tools/bench rig [folder] [case or kind ...]`: how well the rig's model fits recorded sessions (data/README.md, labels.json).
// A row a case: evidence and the model's error in per cent of the range (cavity, its transients, pump, its transients,
// volumes), without and with the labelled effects; their parameters with errors and the truth; seconds.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "estimator/explain/rig/set_fit.hpp"
#include "tools/benchmarks/recorded_cases.hpp"

namespace {

using namespace diastole;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::string text_of(const rig::SessionProblem& problem, const explain::EffectSet& set) {
  std::string text = fmt::format("ln evidence {:9.1f}, model's error %:", set.evidence.log_evidence);
  for (const double share : set.evidence.shares)
    text += fmt::format(" {:.3f}", 100.0 * share);
  const rig::RigModel model = problem.model(set.model);
  return text + fmt::format(" | C1 {:.4f} off {:.1f} {:.1f}; {}", model.modulus_kPa,
                            1e3 * model.cavity_offset_kPa, 1e3 * model.pump_offset_kPa,
                            inference::sentence(set.termination));
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
  const rig::SessionProblem problem(session, family, 2);
  const rig::LinearisedModel base = rig::declared_rig(problem);
  const explain::EffectSet plain = explain::fit_set(problem, base.at, base, problem.error().prior.share);
  std::string kinds;
  for (const auto& truth : label["truth"])
    kinds += fmt::format("{}{}", kinds.empty() ? "" : "+", truth["id"].get<std::string>());
  fmt::print("{} {:11} {:38} d {:8.1f} {} ({:.4f}, {:.1f}) noise {:.1f} cycles {:.2e} ({:.2e}) {:.1f} s\n",
             recorded.name, label["kind"].get<std::string>(), kinds, label["d"].get<double>(),
             text_of(problem, plain), label["C1_kPa"].get<double>(), label["offset_Pa"].get<double>(),
             1e3 * problem.noise().channels.at(rig::Channel::cavity).sd_kPa, problem.noise().cycle_sd,
             label["beat_sd"].get<double>(), seconds_since(begun));
  rig::SessionModel start = base.at;
  start.terms = labelled(label, session);
  if (start.terms.empty()) return;
  for (const rig::ModelTerm& term : start.terms)
    for (const EffectParameter& parameter : term.effect->parameters())
      start.values.push_back(parameter.typical);
  const auto second = std::chrono::steady_clock::now();
  const explain::EffectSet with =
      explain::fit_set_exactly(problem, explain::fit_set(problem, start, base, problem.error().prior.share));
  fmt::print("    with {}; {:.1f} s\n", text_of(problem, with), seconds_since(second));
  for (size_t i = 0; i < with.unknowns.size(); ++i)
    fmt::print("        {} = {:.6g} +- {:.2g}\n", with.unknowns[i].name, with.model.values[i],
               with.errors[i]);
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
