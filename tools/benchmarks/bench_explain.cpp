// `tools/bench explain [folder] [case or kind ...]`: explains recorded sessions and counts what was right (data/README.md,
// labels.json); the folder may be one of imaged motion instead (bench_explain_field.hpp). A row a case, then the table of
// figures with their targets. Exit code 1 if a session in which nothing is hidden was given an effect, or one with an
// effect of no library a confident name. Explanations are kept in build/explained/FOLDER/.
// `tools/bench explain --worlds`: explain_worlds.hpp; exit code 1 if any target is missed.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "estimator/explain/rig/explain_rig.hpp"
#include "estimator/explain/verdict/explanation_json.hpp"
#include "tools/benchmarks/bench_explain_field.hpp"
#include "tools/benchmarks/explain_worlds.hpp"
#include "tools/benchmarks/recorded_cases.hpp"
#include "tools/score/score.hpp"

namespace {

using namespace diastole;
namespace fs = std::filesystem;
using Ids = std::set<std::string>;

Ids truth_of(const nlohmann::json& label) {
  Ids ids;
  for (const auto& truth : label["truth"])
    ids.insert(truth["id"].get<std::string>());
  return ids;
}

std::string shown(const Ids& ids) { return ids.empty() ? "-" : fmt::format("{}", fmt::join(ids, "+")); }

void report(const std::string& name, const nlohmann::json& label, const explain::Explanation& found) {
  Ids named;
  for (const explain::FoundEffect& effect : found.effects)
    named.insert(effect.id);
  std::string others;
  for (const auto& set : found.ambiguous_with)
    others += " | " + shown(Ids(set.begin(), set.end()));
  fmt::print(
      "{} {:11} d {:8.1f} {:42} -> {:11} {}{}\n    gap {:.4f} {:.4f} floor {:.4f} closed {:.3f}, {:.1f} s\n",
      name, label["kind"].get<std::string>(), label["d"].get<double>(), shown(truth_of(label)),
      name_of(found.verdict), shown(named), others, found.gap.before, found.gap.after, found.gap.floor,
      found.gap.closed, found.seconds);
  for (const explain::FoundEffect& effect : found.effects)
    for (const explain::FoundParameter& parameter : effect.parameters)
      fmt::print("    {} {} = {:.6g} +- {:.2g} [{:.6g} {:.6g}]\n", effect.id, parameter.name, parameter.value,
                 parameter.standard_error, parameter.ci90[0], parameter.ci90[1]);
  for (const auto& truth : label["truth"])
    fmt::print("    truth {} {}\n", truth["id"].get<std::string>(), truth["parameters"].dump());
  for (size_t k = 0; k < std::min<size_t>(found.evidence.size(), 7); ++k) {
    const explain::Candidate& row = found.evidence[k];
    fmt::print("      {} {:10.1f} {} {}\n", row.refitted ? "fit " : "gain", row.chi_square_drop,
               fmt::join(row.ids, "+"), row.verdict);
  }
  for (size_t k = 0; k < std::min<size_t>(found.where.size(), 5); ++k) {
    const explain::Misfit& place = found.where[k];
    fmt::print("      where {} {} {} seg {} phase {} band {} excess {:.0f} p {:.1g}\n", place.port, place.run,
               place.channel, place.segment.value_or(-1),
               place.phase ? fmt::format("{:.1f}-{:.1f}", (*place.phase)[0], (*place.phase)[1]) : "-",
               place.band_Hz ? fmt::format("{:g}-{:g}", (*place.band_Hz)[0], (*place.band_Hz)[1]) : "-",
               place.excess_chi2, place.p_value);
  }
  std::fflush(stdout);
}

void explain_sessions(const bench::Recordings& recordings, const fs::path& kept) {
  bench::visit_cases(recordings, [&](const bench::RecordedCase& recorded) {
    explain::Explanation found =
        explain::explain_rig(read_study(recorded.study), {.threads = 2, .progress = {}});
    report(recorded.name, recorded.label, found);
    found.traces.clear();
    std::ofstream(kept / (recorded.name + ".json")) << explain::to_json(found);
  });
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Explains recorded sessions and counts what was right.", "tools/bench explain");
  std::vector<std::string> words;
  bool worlds = false;
  const fs::path source = DIASTOLE_SOURCE_DIR;
  bench::WorldsOptions of_worlds{.data = source.parent_path() / "shared/data",
                                 .kept = source / "build/explained/worlds"};
  app.add_option("FOLDER", words, "with a labels.json, then names or kinds of the cases wanted");
  app.add_flag("--worlds", worlds, "three worlds, with references and without (explain_worlds.hpp)");
  app.add_option("--only", of_worlds.worlds, "these of the three")->check(CLI::Range(1, 3));
  app.add_option("--rounds", of_worlds.rounds, "of world 3, 40 sessions each")->capture_default_str();
  app.add_option("--first-round", of_worlds.first_round, "of world 3: its rig")->capture_default_str();
  app.add_flag("--proposals", of_worlds.proposals,
               "of world 3: run the experiments that answers propose, and ask again");
  app.add_flag("--resume", of_worlds.resume, "keep what a stopped run answered");
  CLI11_PARSE(app, argc, argv);
  if (worlds) return bench::explain_worlds(of_worlds) ? 0 : 1;

  const auto recordings = bench::recordings_of(argc, argv);
  if (!recordings) return 0;
  const fs::path kept = fs::path(DIASTOLE_SOURCE_DIR) / "build/explained" /
                        fs::absolute(recordings->folder / "").parent_path().filename();
  fs::remove_all(kept);  // what is scored is of this run
  fs::create_directories(kept);
  if (recordings->labels.contains("cases")) {
    bench::explain_imaged_motion(recordings->folder, recordings->wanted, kept);
  } else {
    explain_sessions(*recordings, kept);
  }
  const explain::Score score = explain::score_folder(recordings->folder, kept);
  fmt::print("\n{}", explain::in_words(score));
  return score.passed() ? 0 : 1;
}
