#include "tools/score/score.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "estimator/effects/effect.hpp"
#include "estimator/explain/verdict/explanation_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/contract/named_members.hpp"

namespace diastole::explain {
namespace {

namespace fs = std::filesystem;
using Ids = std::vector<std::string>;

constexpr double precise_sigma = 20.0, separated_sigma = 5.0, usual_s = 10.0, longest_s = 30.0;

Ids sorted(Ids ids) {
  std::ranges::sort(ids);
  return ids;
}

Ids found_ids(const Explanation& found) {
  Ids ids;
  for (const FoundEffect& effect : found.effects)
    ids.push_back(effect.id);
  return sorted(ids);
}

/// Sets that fit as well; the rig's own error is known if there was a reference.
std::vector<Ids> alternatives_of(const ScoredCase& c) {
  std::vector<Ids> sets = c.truth.alternatives;
  if (!c.found.model_error || c.found.model_error->source != "reference")
    sets.insert(sets.end(), c.truth.alternatives_without_reference.begin(),
                c.truth.alternatives_without_reference.end());
  for (Ids& set : sets)
    set = sorted(set);
  return sets;
}

bool has_alternatives(const ScoredCase& c) { return !alternatives_of(c).empty(); }

bool no_effect_fits(const ScoredCase& c) { return std::ranges::count(alternatives_of(c), Ids{}) > 0; }

}  // namespace

bool is_exact(const ScoredCase& c) {
  return c.found.verdict == Verdict::named && found_ids(c.found) == c.truth.ids();
}

namespace {

/// The truth is among the sets left open, or nothing was said where nothing can be seen.
bool is_inside(const ScoredCase& c) {
  if (c.found.verdict == Verdict::none) return no_effect_fits(c);
  if (c.found.verdict == Verdict::unexplained) return false;
  if (found_ids(c.found) == c.truth.ids()) return true;
  return std::ranges::any_of(c.found.ambiguous_with,
                             [&](const Ids& ids) { return sorted(ids) == c.truth.ids(); });
}

double neutral_of(const std::string& parameter) { return parameter == "inertance_factor" ? 1.0 : 0.0; }

/// Is the named effect an imperfection of this rig, reported at no more than three times its size?
bool is_imperfection(const FoundEffect& effect, const Truth& truth) {
  const auto known = std::ranges::find(truth.imperfections, effect.id, &HiddenEffect::id);
  if (known == truth.imperfections.end()) return false;
  for (const FoundParameter& parameter : effect.parameters) {
    const auto size = known->parameters.find(parameter.name);
    if (size == known->parameters.end()) continue;
    const double neutral = neutral_of(parameter.name);
    return std::abs(parameter.value - neutral) <= 3 * std::abs(size->second - neutral);
  }
  return true;
}

/// Claims an effect that is not there, or leaves open what it is where nothing is.
bool is_wrong_name(const ScoredCase& c) {
  const Ids truth = c.truth.ids();
  Ids claimed;
  for (const FoundEffect& effect : c.found.effects)
    if (std::ranges::count(truth, effect.id) > 0 || !is_imperfection(effect, c.truth))
      claimed.push_back(effect.id);
  if (c.found.verdict == Verdict::ambiguous) {
    return c.truth.kind == TruthKind::none && !claimed.empty() &&
           std::ranges::none_of(c.found.ambiguous_with, [](const Ids& set) { return set.empty(); });
  }
  if (std::ranges::count(alternatives_of(c), sorted(claimed)) > 0) return false;
  return std::ranges::any_of(claimed,
                             [&](const std::string& id) { return std::ranges::count(truth, id) == 0; });
}

bool is_right(const ScoredCase& c) {
  if (!c.truth.acceptable.empty() && std::ranges::count(c.truth.acceptable, c.found.verdict) == 0)
    return false;
  switch (c.truth.kind) {
    case TruthKind::none:
      return c.found.verdict == Verdict::none ||
             (c.found.verdict == Verdict::unexplained && !is_wrong_name(c));
    case TruthKind::outside:
      return c.found.verdict == Verdict::unexplained && !is_wrong_name(c);
    case TruthKind::inseparable:
      return !is_wrong_name(c) && (c.found.verdict != Verdict::ambiguous || is_inside(c));
    case TruthKind::single:
      if (std::ranges::count(c.truth.acceptable, Verdict::ambiguous) > 0) return is_inside(c);
      if (c.truth.size == EffectSize::small)
        return !is_wrong_name(c) && (c.found.verdict != Verdict::ambiguous || is_inside(c));
      return c.truth.size == EffectSize::medium || has_alternatives(c) ? is_inside(c) : is_exact(c);
    case TruthKind::pair:
      if (c.truth.size != EffectSize::large) return !is_wrong_name(c);
      return has_alternatives(c) ? is_inside(c) : is_exact(c);
  }
  return false;
}

}  // namespace

std::string answer_of(const Explanation& found) {
  const Ids ids = found_ids(found);
  const std::string set = fmt::format("{}", fmt::join(ids, " + "));
  switch (found.verdict) {
    case Verdict::named:
      return set;
    case Verdict::none:
      return "none";
    case Verdict::unexplained:
      return ids.empty() ? "unexplained" : "unexplained beside " + set;
    case Verdict::ambiguous: {
      std::string all = "ambiguous: " + (ids.empty() ? "nothing" : set);
      for (const Ids& other : found.ambiguous_with)
        all += " | " + (other.empty() ? std::string("nothing") : fmt::format("{}", fmt::join(other, " + ")));
      return all;
    }
  }
  return "";
}

std::string hidden_words(const ScoredCase& c) {
  const Ids ids = c.truth.ids();
  if (ids.empty()) return "none";
  const std::string set = fmt::format("{}", fmt::join(ids, " + "));
  if (c.truth.kind == TruthKind::inseparable || has_alternatives(c)) return set + " (inseparable)";
  if (c.truth.size == EffectSize::large) return set;
  return set + (c.truth.size == EffectSize::medium ? " (medium)" : " (small)");
}

namespace {

/// "" if neither the file nor the list of effects knows it.
std::string port_of(const HiddenEffect& effect) {
  if (!effect.port.empty()) return effect.port;
  const Effect* known = find_effect(effect.id);
  return known == nullptr ? "" : std::string(diastole::name_of(known->text().port));
}

std::optional<bool> is_port_right(const ScoredCase& c) {
  if (c.found.where.empty() || c.found.verdict == Verdict::none) return std::nullopt;
  bool port_known = false;
  for (const HiddenEffect& effect : c.truth.hidden) {
    const std::string port = port_of(effect);
    port_known = port_known || !port.empty();
    if (port == c.found.where.front().port) return true;
  }
  return port_known ? std::optional(false) : std::nullopt;
}

struct ParameterError {
  double relative;
  bool covered;
};

/// Of each effect named right, the first parameter that the truth states too: the effect's size.
std::vector<ParameterError> parameter_errors(const ScoredCase& c) {
  std::vector<ParameterError> errors;
  for (const HiddenEffect& hidden : c.truth.hidden) {
    const auto found = std::ranges::find(c.found.effects, hidden.id, &FoundEffect::id);
    if (found == c.found.effects.end()) continue;
    for (const FoundParameter& parameter : found->parameters) {
      const auto truth = hidden.parameters.find(parameter.name);
      if (truth == hidden.parameters.end()) continue;
      errors.push_back(
          {std::abs(parameter.value - truth->second) / std::abs(truth->second - neutral_of(parameter.name)),
           parameter.ci90[0] <= truth->second && truth->second <= parameter.ci90[1]});
      break;
    }
  }
  return errors;
}

/// A share of the values is at or below it; NaN of none.
double quantile(std::vector<double> values, double part) {
  if (values.empty()) return std::nan("");
  std::ranges::sort(values);
  const double place = part * static_cast<double>(values.size() - 1);
  const auto below = static_cast<size_t>(place);
  const size_t above = std::min(below + 1, values.size() - 1);
  return std::lerp(values[below], values[above], place - static_cast<double>(below));
}

struct Target {
  bool at_least;
  double bound;
  std::optional<double> at_most = {};
};

/// The row with its target in words, and whether it is met; a target that all shares meet is none.
ScoreRow judged(ScoreRow row, const Target& target) {
  const auto words = [&](double part) {
    return row.is_share ? fmt::format("{:g} %", 100 * part) : fmt::format("{:g}", part);
  };
  const bool free = row.is_share && (target.at_most    ? target.bound <= 0 && *target.at_most >= 1
                                     : target.at_least ? target.bound <= 0
                                                       : target.bound >= 1);
  if (free) return row;
  row.target = target.at_most ? fmt::format("{} to {}", words(target.bound), words(*target.at_most))
                              : fmt::format("{} {}", target.at_least ? ">=" : "<=", words(target.bound));
  row.met = row.cases == 0 || ((target.at_least ? row.value >= target.bound : row.value <= target.bound) &&
                               (!target.at_most || row.value <= *target.at_most));
  return row;
}

ScoreRow share(const char* figure, const Target& target, size_t hits, size_t cases, bool decisive = false) {
  const double value = cases == 0 ? std::nan("") : static_cast<double>(hits) / static_cast<double>(cases);
  return judged({.figure = figure,
                 .value = value,
                 .hits = hits,
                 .cases = cases,
                 .interval = clopper_pearson(hits, cases),
                 .decisive = decisive},
                target);
}

ScoreRow middle(const char* figure, const Target& target, const std::vector<double>& values,
                double part = 0.5) {
  return judged(
      {.figure = figure, .value = quantile(values, part), .cases = values.size(), .is_share = false}, target);
}

template <TruthKind kind>
bool is_of(const ScoredCase& c) {
  return c.truth.kind == kind;
}
template <Verdict verdict>
bool answers(const ScoredCase& c) {
  return c.found.verdict == verdict;
}
template <EffectSize size>
bool is_single(const ScoredCase& c) {
  return is_of<TruthKind::single>(c) && c.truth.size == size &&
         (size == EffectSize::small || !has_alternatives(c));
}
bool is_large_pair(const ScoredCase& c) {
  return is_of<TruthKind::pair>(c) && c.truth.size == EffectSize::large;
}
bool is_open(const ScoredCase& c) {
  return is_of<TruthKind::inseparable>(c) ||
         (is_of<TruthKind::single>(c) && c.truth.size != EffectSize::small && has_alternatives(c));
}
bool will_be_separated(const ScoredCase& c) {
  return c.found.next_experiment && c.found.next_experiment->predicted_separation_sigma >= separated_sigma;
}
bool is_any(const ScoredCase&) { return true; }

/// A row that says of how many of some cases something is true.
struct ShareFigure {
  const char* figure;
  Target target;
  bool (*counts)(const ScoredCase&);
  bool (*hits)(const ScoredCase&);
  bool decisive = false;
};

std::vector<ShareFigure> naming(const Targets& asked) {
  return {
      {"none: falsely named", {false, asked.none_named}, is_of<TruthKind::none>, is_wrong_name, true},
      {"single, large: exact name", {true, asked.large_exact}, is_single<EffectSize::large>, is_right},
      {"single, medium: named or among the sets",
       {true, asked.medium_inside},
       is_single<EffectSize::medium>,
       is_right},
      {"single, small: wrong name", {false, asked.small_wrong}, is_single<EffectSize::small>, is_wrong_name},
      {"pairs, both large: exact", {true, asked.pairs_exact}, is_large_pair, is_right},
      {"pairs: any false name", {false, asked.pairs_false}, is_of<TruthKind::pair>, is_wrong_name},
      {"outside the library: wrongly named",
       {false, asked.outside_named},
       is_of<TruthKind::outside>,
       is_wrong_name,
       true},
      {"outside the library: unexplained", {true, 0}, is_of<TruthKind::outside>, is_right},
      {"inseparable: right, or silent", {true, 1 - asked.any_wrong}, is_open, is_right},
      {"any: wrong name", {false, asked.any_wrong}, is_any, is_wrong_name},
      {"ambiguous: proposed experiment separates it (predicted, 5 sigma)",
       {true, 0},
       answers<Verdict::ambiguous>,
       will_be_separated}};
}

std::vector<ScoreRow> rows_of(const std::vector<ScoredCase>& cases, const Targets& asked) {
  std::vector<ScoreRow> rows;
  for (const ShareFigure& row : naming(asked)) {
    const auto count = std::ranges::count_if(cases, row.counts);
    const auto hits =
        std::ranges::count_if(cases, [&](const auto& c) { return row.counts(c) && row.hits(c); });
    rows.push_back(
        share(row.figure, row.target, static_cast<size_t>(hits), static_cast<size_t>(count), row.decisive));
  }
  std::vector<double> errors, gaps, seconds;
  size_t covered = 0, ports = 0, ports_right = 0;
  for (const ScoredCase& c : cases) {
    if (is_exact(c)) {
      if (!(c.truth.size_sigma < precise_sigma)) {
        for (const ParameterError& error : parameter_errors(c)) {
          errors.push_back(error.relative);
          covered += error.covered ? 1 : 0;
        }
      }
      gaps.push_back(c.found.gap.closed);
    }
    if (c.found.seconds > 0) seconds.push_back(c.found.seconds);
    if (const auto right = is_port_right(c)) {
      ++ports;
      ports_right += *right ? 1 : 0;
    }
  }
  rows.push_back(middle("parameter error at d >= 20, median", {false, 0.10}, errors));
  rows.push_back(share("parameter's 90 % interval covers", {true, asked.interval[0], asked.interval[1]},
                       covered, errors.size()));
  rows.push_back(middle("gap closed on held-out runs, median", {true, 0.80}, gaps));
  rows.push_back(share("port of the misfit right", {true, 0}, ports_right, ports));
  rows.push_back(middle("seconds a case, median", {false, usual_s}, seconds));
  rows.push_back(middle("seconds a case, 95 %", {false, longest_s}, seconds, 0.95));
  return rows;
}

/// What was said may be taken as true: nothing named wrongly and nothing large passed over.
bool is_verdict_true(const ScoredCase& c) {
  switch (c.found.verdict) {
    case Verdict::named:
      return !is_wrong_name(c) && (is_exact(c) || c.truth.kind == TruthKind::pair || has_alternatives(c));
    case Verdict::ambiguous:
      return is_inside(c);
    case Verdict::unexplained:
      return !is_wrong_name(c) && c.truth.kind != TruthKind::none;
    case Verdict::none:
      return c.truth.kind == TruthKind::none || c.truth.kind == TruthKind::inseparable || no_effect_fits(c) ||
             (c.truth.kind == TruthKind::single && c.truth.size == EffectSize::small);
  }
  return false;
}

std::vector<Reliability> reliability_of(const std::vector<ScoredCase>& cases) {
  std::vector<Reliability> bins;
  constexpr std::array edges{0.0, 0.5, 0.8, 0.9, 0.95, 0.99, 1.0};
  for (size_t k = 0; k + 1 < edges.size(); ++k) {
    Reliability bin{.said = {edges[k], edges[k + 1]}};
    for (const ScoredCase& c : cases) {
      if (!c.found.confidence || *c.found.confidence < edges[k]) continue;
      if (*c.found.confidence >= edges[k + 1] && k + 2 < edges.size()) continue;
      bin.mean += *c.found.confidence;
      bin.right += is_verdict_true(c) ? 1 : 0;
      ++bin.cases;
    }
    if (bin.cases == 0) continue;
    bin.mean /= static_cast<double>(bin.cases);
    bins.push_back(bin);
  }
  return bins;
}

}  // namespace

bool Score::passed() const {
  return std::ranges::all_of(rows, [](const ScoreRow& row) { return row.met || !row.decisive; });
}

bool Score::met() const { return std::ranges::all_of(rows, &ScoreRow::met); }

std::array<double, 2> clopper_pearson(size_t hits, size_t cases) {
  if (cases == 0) return {0, 1};
  using Binomial = boost::math::binomial_distribution<>;
  // Where nothing is beyond one side, all of the 5 % are on the other: "0 of 8" is "at most 31 %".
  const double each_side = hits == 0 || hits == cases ? 0.05 : 0.025;
  const auto n = static_cast<double>(cases), k = static_cast<double>(hits);
  return {hits == 0 ? 0 : Binomial::find_lower_bound_on_p(n, k, each_side),
          hits == cases ? 1 : Binomial::find_upper_bound_on_p(n, k, each_side)};
}

Score score_cases(const std::vector<ScoredCase>& cases, const Targets& targets) {
  Score score;
  score.rows = rows_of(cases, targets);
  score.reliability = reliability_of(cases);
  std::map<std::pair<std::string, std::string>, Confusion> confusion;
  for (const ScoredCase& c : cases) {
    const std::string hidden = hidden_words(c), answer = answer_of(c.found);
    Confusion& cell = confusion[{hidden, answer}];
    cell = {hidden, answer, cell.count + 1, is_right(c)};
  }
  for (const auto& [key, cell] : confusion)
    score.confusion.push_back(cell);
  return score;
}

Score score_folder(const fs::path& truths, const fs::path& results, const Targets& targets) {
  std::vector<ScoredCase> cases;
  std::vector<std::string> missing;
  for (Truth& truth : read_truths(truths)) {
    const fs::path candidates[] = {results / truth.name / "explanation.json",
                                   results / (truth.name + ".json")};
    const auto* file =
        std::ranges::find_if(candidates, [](const fs::path& path) { return fs::exists(path); });
    if (file == std::end(candidates)) {
      missing.push_back(truth.name);
      continue;
    }
    Explanation found = explanation_from_json(read_whole_file(*file), file->string());
    cases.push_back({std::move(truth), std::move(found)});
  }
  if (cases.empty()) {
    throw InputError(
        {results.string(), "", "holds no explanation of any of the hidden cases",
         "Explain each case into a folder of its name: diastole explain NAME.study.toml -o RESULTS/NAME."});
  }
  Score score = score_cases(cases, targets);
  score.missing = std::move(missing);
  return score;
}

std::string in_words(const Score& score) {
  std::string text = "What was hidden -> what was answered\n";
  size_t widest = 0;
  for (const Confusion& cell : score.confusion)
    widest = std::max(widest, cell.hidden.size());
  for (const Confusion& cell : score.confusion)
    text += fmt::format("  {} {:3}  {:{}}  -> {}\n", cell.right ? " " : "x", cell.count, cell.hidden, widest,
                        cell.answer);
  text += fmt::format("\n  {:64} {:>13} {:>8} {:>9}  {}\n", "figure", "target", "found", "cases", "95 %");
  for (const ScoreRow& row : score.rows) {
    const std::string value = row.cases == 0 ? "-"
                              : row.is_share ? fmt::format("{:.1f} %", 100 * row.value)
                                             : fmt::format("{:.3g}", row.value);
    text +=
        fmt::format("{} {:64} {:>13} {:>8} {:>9}  {}\n", row.met ? " " : "x", row.figure, row.target, value,
                    row.is_share ? fmt::format("{}/{}", row.hits, row.cases) : fmt::format("{}", row.cases),
                    row.is_share && row.cases > 0
                        ? fmt::format("{:.0f} to {:.0f} %", 100 * row.interval[0], 100 * row.interval[1])
                        : "");
  }
  if (!score.reliability.empty()) text += "\n  said with a confidence of       right         95 %\n";
  for (const Reliability& bin : score.reliability) {
    const auto [low, high] = clopper_pearson(bin.right, bin.cases);
    text += fmt::format("  {:5.2f} to {:4.2f}, mean {:5.3f} {:>11}  {:3.0f} %  {:.0f} to {:.0f} %\n",
                        bin.said[0], bin.said[1], bin.mean, fmt::format("{}/{}", bin.right, bin.cases),
                        100.0 * static_cast<double>(bin.right) / static_cast<double>(bin.cases), 100 * low,
                        100 * high);
  }
  if (!score.missing.empty())
    text += fmt::format("\nWithout an explanation: {}\n", fmt::join(score.missing, ", "));
  if (!score.passed()) text += "\nFAILED: a row on none or outside misses its target.\n";
  return text;
}

std::string to_json(const Score& score) {
  nlohmann::ordered_json json;
  json["passed"] = score.passed();
  json["rows"] = nlohmann::ordered_json::array();
  for (const ScoreRow& row : score.rows) {
    nlohmann::ordered_json line = {DIASTOLE_NAMED(row, figure, target, value, cases, met, decisive)};
    if (!std::isfinite(row.value)) line["value"] = nullptr;
    if (row.is_share) {
      line["hits"] = row.hits;
      line["interval95"] = row.interval;
    }
    json["rows"].push_back(line);
  }
  json["confusion"] = nlohmann::ordered_json::array();
  for (const Confusion& cell : score.confusion)
    json["confusion"].push_back({DIASTOLE_NAMED(cell, hidden, answer, count, right)});
  json["reliability"] = nlohmann::ordered_json::array();
  for (const Reliability& bin : score.reliability)
    json["reliability"].push_back({DIASTOLE_NAMED(bin, said, mean, right, cases)});
  json["missing"] = score.missing;
  return json_text(json, 1);
}

ExitCode print_score(const std::filesystem::path& truths, const std::filesystem::path& results,
                     const CommandOutput& out) {
  const Score score = score_folder(truths, results);
  fmt::print("{}", out.json ? to_json(score) + "\n" : in_words(score));
  return score.passed() ? ExitCode::done : ExitCode::negative;
}

}  // namespace diastole::explain
