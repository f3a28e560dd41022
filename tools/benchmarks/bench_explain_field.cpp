#include "tools/benchmarks/bench_explain_field.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>

#include "estimator/explain/imaging/explain_field.hpp"
#include "estimator/explain/verdict/explanation_json.hpp"
#include "tools/score/truth_file.hpp"

namespace diastole::bench {
namespace {

using explain::Explanation;
using explain::Truth;

std::string shown(const std::vector<std::string>& ids) {
  return ids.empty() ? "-" : fmt::format("{}", fmt::join(ids, "+"));
}

void report(const Truth& truth, const Explanation& found) {
  std::vector<std::string> named;
  for (const explain::FoundEffect& effect : found.effects)
    named.push_back(effect.id);
  std::string others;
  for (const auto& set : found.ambiguous_with)
    others += " | " + shown(set);
  fmt::print("{:17} {:11} d {:6.1f} {:24} -> {:11} {}{}\n    gap {:.2f} {:.2f} closed {:.2f}, {:.0f} s\n",
             truth.name, name_of(truth.kind), truth.size_sigma, shown(truth.ids()), name_of(found.verdict),
             shown(named), others, found.gap.before, found.gap.after, found.gap.closed, found.seconds);
  for (const explain::FoundEffect& effect : found.effects)
    for (const explain::FoundParameter& parameter : effect.parameters)
      fmt::print("    {} = {:.4g} [{:.4g} {:.4g}]\n", parameter.name, parameter.value, parameter.ci90[0],
                 parameter.ci90[1]);
  for (const explain::HiddenEffect& hidden : truth.hidden)
    for (const auto& [name, value] : hidden.parameters)
      fmt::print("    truth {} = {:g}\n", name, value);
  for (const explain::Misfit& place : found.where)
    fmt::print("    where {} excess {:.0f} p {:.1g}\n", place.region, place.excess_chi2, place.p_value);
  std::fflush(stdout);
}

bool chosen(const Truth& truth, const std::vector<std::string>& wanted) {
  return wanted.empty() || std::ranges::any_of(wanted, [&](const std::string& word) {
           return word == truth.name || word == name_of(truth.kind);
         });
}

}  // namespace

void explain_imaged_motion(const std::filesystem::path& folder, const std::vector<std::string>& wanted,
                           const std::filesystem::path& kept) {
  for (const Truth& truth : explain::read_truths(folder)) {
    const std::filesystem::path file = folder / (truth.name + ".study.toml");
    if (!chosen(truth, wanted) || !std::filesystem::exists(file)) continue;
    Explanation found = explain::explain_field(read_study(file));
    report(truth, found);
    found.field.clear();
    std::ofstream(kept / (truth.name + ".json")) << explain::to_json(found);
  }
}

}  // namespace diastole::bench
