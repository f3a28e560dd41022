#include "tools/score/score.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>

#include "estimator/effects/effect.hpp"
#include "estimator/explain/verdict/explanation_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::explain {
namespace {

namespace fs = std::filesystem;
using Ids = std::vector<std::string>;

constexpr double separable_sigma = 8.0, precise_sigma = 20.0, separated_sigma = 5.0, longest_s = 60.0;

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

bool has_alternatives(const Truth& truth) { return !truth.alternatives.empty(); }

bool no_effect_fits(const Truth& truth) { return std::ranges::count(truth.alternatives, Ids{}) > 0; }

bool is_exact(const ScoredCase& c) {
  return c.found.verdict == Verdict::named && found_ids(c.found) == c.truth.ids();
}

/// The truth is among the sets left open, or nothing was said where nothing can be seen.
bool is_inside(const ScoredCase& c) {
  if (c.found.verdict == Verdict::none) return no_effect_fits(c.truth);
  if (c.found.verdict == Verdict::unexplained) return false;
  if (found_ids(c.found) == c.truth.ids()) return true;
  return std::ranges::any_of(c.found.ambiguous_with,
                             [&](const Ids& ids) { return sorted(ids) == c.truth.ids(); });
}

bool has_false_name(const ScoredCase& c) {
  if (c.found.verdict != Verdict::named) return false;
  const Ids truth = c.truth.ids();
  return std::ranges::any_of(found_ids(c.found),
                             [&](const std::string& id) { return std::ranges::count(truth, id) == 0; });
}

bool is_right(const ScoredCase& c) {
  if (!c.truth.acceptable.empty() && std::ranges::count(c.truth.acceptable, c.found.verdict) == 0)
    return false;
  switch (c.truth.kind) {
    case TruthKind::none:
      return c.found.verdict == Verdict::none;
    case TruthKind::outside:
      return c.found.verdict == Verdict::unexplained;
    case TruthKind::inseparable:
      return is_inside(c);
    case TruthKind::single:
    case TruthKind::pair:
      return has_alternatives(c.truth) || std::ranges::count(c.truth.acceptable, Verdict::ambiguous) > 0
                 ? is_inside(c)
                 : is_exact(c);
  }
  return false;
}

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

std::string hidden_words(const Truth& truth) {
  const Ids ids = truth.ids();
  const std::string set = ids.empty() ? "none" : fmt::format("{}", fmt::join(ids, " + "));
  return truth.kind == TruthKind::inseparable || has_alternatives(truth) ? set + " (inseparable)" : set;
}

/// "" if neither the file nor the list of effects knows it.
std::string port_of(const HiddenEffect& effect) {
  if (!effect.port.empty()) return effect.port;
  const Effect* known = find_effect(effect.id);
  return known == nullptr ? "" : std::string(diastole::name_of(known->text().port));
}

std::optional<bool> is_port_right(const ScoredCase& c) {
  if (c.found.where.empty() || c.found.verdict == Verdict::none) return std::nullopt;
  bool told = false;
  for (const HiddenEffect& effect : c.truth.hidden) {
    const std::string port = port_of(effect);
    told = told || !port.empty();
    if (port == c.found.where.front().port) return true;
  }
  return told ? std::optional(false) : std::nullopt;
}

struct ParameterError {
  double relative;
  bool covered;
};

/// Of each effect named right, the first parameter that the truth tells too: the effect's size.
std::vector<ParameterError> parameter_errors(const ScoredCase& c) {
  std::vector<ParameterError> errors;
  for (const HiddenEffect& hidden : c.truth.hidden) {
    const auto found = std::ranges::find(c.found.effects, hidden.id, &FoundEffect::id);
    if (found == c.found.effects.end()) continue;
    for (const FoundParameter& parameter : found->parameters) {
      const auto truth = hidden.parameters.find(parameter.name);
      if (truth == hidden.parameters.end()) continue;
      // An excess counts from 1: it is the part above that has a size.
      const double neutral = parameter.name == "inertance_factor" ? 1.0 : 0.0;
      errors.push_back({std::abs(parameter.value - truth->second) / std::abs(truth->second - neutral),
                        parameter.ci90[0] <= truth->second && truth->second <= parameter.ci90[1]});
      break;
    }
  }
  return errors;
}

double median(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  std::ranges::sort(values);
  const size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

struct Target {
  bool at_least;
  double bound;
  std::optional<double> at_most = {};
};

/// The row with its target in words, and whether it is met.
ScoreRow judged(ScoreRow row, const Target& target) {
  const auto words = [&](double part) {
    return row.is_share ? fmt::format("{:g} %", 100 * part) : fmt::format("{:g}", part);
  };
  row.target = target.at_most ? fmt::format("{} to {}", words(target.bound), words(*target.at_most))
                              : fmt::format("{} {}", target.at_least ? ">=" : "<=", words(target.bound));
  row.met = row.cases == 0 || ((target.at_least ? row.value >= target.bound : row.value <= target.bound) &&
                               (!target.at_most || row.value <= *target.at_most));
  return row;
}

ScoreRow share(const char* figure, const Target& target, size_t hits, size_t cases, bool decisive = false) {
  const double value = cases == 0 ? std::nan("") : static_cast<double>(hits) / static_cast<double>(cases);
  return judged({.figure = figure, .value = value, .hits = hits, .cases = cases, .decisive = decisive},
                target);
}

ScoreRow middle(const char* figure, const Target& target, const std::vector<double>& values) {
  return judged({.figure = figure, .value = median(values), .cases = values.size(), .is_share = false},
                target);
}

template <TruthKind kind>
bool is_of(const ScoredCase& c) {
  return c.truth.kind == kind;
}
template <Verdict verdict>
bool answers(const ScoredCase& c) {
  return c.found.verdict == verdict;
}
bool is_separable(const ScoredCase& c) {
  return is_of<TruthKind::single>(c) && !has_alternatives(c.truth) && !(c.truth.size_sigma < separable_sigma);
}
bool is_open(const ScoredCase& c) {
  return is_of<TruthKind::inseparable>(c) || (is_of<TruthKind::single>(c) && has_alternatives(c.truth));
}
bool will_be_separated(const ScoredCase& c) {
  return c.found.next_experiment && c.found.next_experiment->predicted_separation_sigma >= separated_sigma;
}

/// A row that says of how many of some cases something is true.
struct ShareFigure {
  const char* figure;
  Target target;
  bool (*counts)(const ScoredCase&);
  bool (*hits)(const ScoredCase&);
  bool decisive = false;
};
constexpr ShareFigure naming[] = {
    {"none: falsely named", {false, 0.01}, is_of<TruthKind::none>, answers<Verdict::named>, true},
    {"single effect, separable (d >= 8): exact name", {true, 0.95}, is_separable, is_right},
    {"pairs: both exact", {true, 0.80}, is_of<TruthKind::pair>, is_right},
    {"pairs: any false name", {false, 0.05}, is_of<TruthKind::pair>, has_false_name},
    {"outside the library: abstains",
     {true, 0.85},
     is_of<TruthKind::outside>,
     answers<Verdict::unexplained>,
     true},
    {"outside the library: confidently wrong",
     {false, 0.10},
     is_of<TruthKind::outside>,
     answers<Verdict::named>,
     true},
    {"inseparable: truth inside the ambiguity set", {true, 0.97}, is_open, is_inside},
    {"inseparable: proposed experiment separates it (predicted, 5 sigma)",
     {true, 0.97},
     answers<Verdict::ambiguous>,
     will_be_separated}};

std::vector<ScoreRow> rows_of(const std::vector<ScoredCase>& cases) {
  std::vector<ScoreRow> rows;
  for (const ShareFigure& row : naming) {
    const auto count = std::ranges::count_if(cases, row.counts);
    const auto hits =
        std::ranges::count_if(cases, [&](const auto& c) { return row.counts(c) && row.hits(c); });
    rows.push_back(
        share(row.figure, row.target, static_cast<size_t>(hits), static_cast<size_t>(count), row.decisive));
  }
  std::vector<double> errors, single_gaps, pair_gaps;
  size_t covered = 0, ports = 0, ports_right = 0, in_time = 0;
  for (const ScoredCase& c : cases) {
    if (is_exact(c)) {
      if (!(c.truth.size_sigma < precise_sigma)) {
        for (const ParameterError& error : parameter_errors(c)) {
          errors.push_back(error.relative);
          covered += error.covered ? 1 : 0;
        }
      }
      (c.truth.kind == TruthKind::pair ? pair_gaps : single_gaps).push_back(c.found.gap.closed);
    }
    in_time += c.found.seconds <= longest_s ? 1 : 0;
    if (const auto right = is_port_right(c)) {
      ++ports;
      ports_right += *right ? 1 : 0;
    }
  }
  rows.push_back(middle("parameter error at d >= 20, median", {false, 0.10}, errors));
  rows.push_back(share("parameter's 90 % interval covers", {true, 0.85, 0.95}, covered, errors.size()));
  rows.push_back(middle("gap closed on held-out runs, single, median", {true, 0.90}, single_gaps));
  rows.push_back(middle("gap closed on held-out runs, pairs, median", {true, 0.80}, pair_gaps));
  rows.push_back(share("port of the misfit right", {true, 0.98}, ports_right, ports));
  rows.push_back(share("time a case <= 60 s", {true, 1.0}, in_time, cases.size()));
  return rows;
}

}  // namespace

bool Score::passed() const {
  return std::ranges::all_of(rows, [](const ScoreRow& row) { return row.met || !row.decisive; });
}

Score score_cases(const std::vector<ScoredCase>& cases) {
  Score score;
  score.rows = rows_of(cases);
  std::map<std::pair<std::string, std::string>, Confusion> confusion;
  for (const ScoredCase& c : cases) {
    const std::string hidden = hidden_words(c.truth), answer = answer_of(c.found);
    Confusion& cell = confusion[{hidden, answer}];
    cell = {hidden, answer, cell.count + 1, is_right(c)};
  }
  for (const auto& [key, cell] : confusion)
    score.confusion.push_back(cell);
  return score;
}

Score score_folder(const fs::path& truths, const fs::path& results) {
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
  Score score = score_cases(cases);
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
  text += fmt::format("\n  {:64} {:>12} {:>14} {:>9}\n", "figure", "target", "found", "cases");
  for (const ScoreRow& row : score.rows) {
    const std::string value = row.cases == 0 ? "-"
                              : row.is_share ? fmt::format("{:.1f} %", 100 * row.value)
                                             : fmt::format("{:.3g}", row.value);
    text +=
        fmt::format("{} {:64} {:>12} {:>14} {:>9}\n", row.met ? " " : "x", row.figure, row.target, value,
                    row.is_share ? fmt::format("{}/{}", row.hits, row.cases) : fmt::format("{}", row.cases));
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
    nlohmann::ordered_json line = {{"figure", row.figure}, {"target", row.target},
                                   {"value", nullptr},     {"cases", row.cases},
                                   {"met", row.met},       {"decisive", row.decisive}};
    if (std::isfinite(row.value)) line["value"] = row.value;
    if (row.is_share) line["hits"] = row.hits;
    json["rows"].push_back(line);
  }
  json["confusion"] = nlohmann::ordered_json::array();
  for (const Confusion& cell : score.confusion)
    json["confusion"].push_back(
        {{"hidden", cell.hidden}, {"answer", cell.answer}, {"count", cell.count}, {"right", cell.right}});
  json["missing"] = score.missing;
  return json.dump(1);
}

ExitCode print_score(const std::filesystem::path& truths, const std::filesystem::path& results,
                     const CommandOutput& out) {
  const Score score = score_folder(truths, results);
  fmt::print("{}", out.json ? to_json(score) + "\n" : in_words(score));
  return score.passed() ? ExitCode::done : ExitCode::negative;
}

}  // namespace diastole::explain
