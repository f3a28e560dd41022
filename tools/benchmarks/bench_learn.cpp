// `tools/bench learn [folder] [case or kind ...]`: what is learnt (explain/rig/learned_term.hpp) of recorded sessions that the
// rig's model alone is fitted to, whatever their verdict would be (data/README.md, labels.json). A row a case: what is hidden, port and
// variables of what is proposed, the gap on waveforms that were not fitted, what it looks like; then counts with 95 % intervals
// of proposals where nothing is hidden, and where something of no library is, and of those that close 70 % of the gap. Studies NAME-with-reference.study.toml are
// taken where they are.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "estimator/explain/rig/learned_term.hpp"
#include "estimator/explain/rig/reference_file.hpp"
#include "estimator/explain/rig/set_fit.hpp"
#include "tools/benchmarks/recorded_cases.hpp"
#include "tools/score/score.hpp"

namespace {

using namespace diastole;

std::string hidden_in(const nlohmann::json& label) {
  std::string kinds;
  for (const auto& truth : label["truth"])
    kinds += fmt::format("{}{}", kinds.empty() ? "" : "+", truth["id"].get<std::string>());
  return kinds.empty() ? "-" : kinds;
}

explain::EffectSet fitted_plain(const rig::SessionProblem& problem) {
  const rig::LinearisedModel base = rig::declared_rig(problem);
  const explain::EffectSet plain = explain::fit_set(problem, base.at, base, problem.error().prior.share);
  explain::EffectSet again = explain::fit_set_exactly(problem, plain);
  return inference::is_settled(again.termination) ? again : plain;
}

std::optional<explain::LearnedTerm> learnt(const std::filesystem::path& file) {
  const Study study = read_study(file);
  const rig::Session session = rig::read_session(study);
  const rig::SpecimenFamily family(study);
  std::optional<explain::Reference> reference;
  if (!study.data.reference.empty()) reference = explain::reference_of(study, 2, {});
  rig::SessionProblem problem(
      session, family, 2,
      reference ? explain::learnt_tolerances(*reference) : std::vector<std::string_view>{});
  if (reference) explain::use_reference(*reference, problem);
  return explain::learn_term(problem, fitted_plain(problem), {reference.has_value()}).term;
}

/// How often something is so.
struct Share {
  size_t hits = 0, cases = 0;

  void add(bool hit) {
    hits += hit ? 1 : 0;
    ++cases;
  }
  void print(std::string_view what) const {
    const auto [low, high] = explain::clopper_pearson(hits, cases);
    fmt::print("{}: {} of {} (95 %: {:.0f} to {:.0f} %)\n", what, hits, cases, 100.0 * low, 100.0 * high);
  }
};

}  // namespace

int main(int argc, char** argv) {
  const auto recordings = bench::recordings_of(argc, argv);
  if (!recordings) return 0;
  constexpr double closed_well = 0.7;  // of the gap on waveforms that were not fitted
  Share of_none, of_outside, closed;
  bench::visit_cases(*recordings, [&](const bench::RecordedCase& recorded) {
    const auto begun = std::chrono::steady_clock::now();
    std::filesystem::path study = recorded.study;
    const auto with_reference = study.parent_path() / (recorded.name + "-with-reference.study.toml");
    if (std::filesystem::exists(with_reference)) study = with_reference;
    const auto term = learnt(study);
    const std::string kind = recorded.label["kind"];
    if (kind == "none") of_none.add(term.has_value());
    if (kind == "outside") of_outside.add(term.has_value());
    if (kind == "outside" && term) closed.add(term->gap.closed >= closed_well);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    fmt::print("{} {:11} {:38} {:5.1f} s -> ", recorded.name, kind, hidden_in(recorded.label), seconds);
    if (!term) {
      fmt::print("nothing\n");
    } else {
      fmt::print("{} {}({}): gap {:.2f} -> {:.2f}, {:.0f} % closed; {}\n", term->port, term->sets,
                 fmt::join(term->variables, ", "), term->gap.before, term->gap.after,
                 100.0 * term->gap.closed, fmt::join(term->readings, "; "));
      for (const auto& rival : term->rivals)
        fmt::print("    or {} {}({})\n", rival.port, rival.sets, fmt::join(rival.variables, ", "));
      for (const auto& shift : term->shifts)
        fmt::print("    {} {:.4f} +- {:.4f} -> {:.4f} +- {:.4f}\n", shift.name, shift.before,
                   shift.before_error, shift.after, shift.after_error);
      for (size_t k = 0; k < term->curve.size(); ++k)
        fmt::print("    {:10.4g} {:10.4g} [{:.4g} {:.4g}]\n", term->curve[k][0], term->curve[k][1],
                   term->band[k][0], term->band[k][1]);
    }
    std::fflush(stdout);
  });
  of_none.print("a law where nothing is hidden");
  of_outside.print("a law where something of no library is hidden");
  closed.print("of these 70 % of the gap closed");
}
