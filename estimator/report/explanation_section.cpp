#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "estimator/effects/effect.hpp"
#include "estimator/report/explanation_views.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/sections.hpp"
#include "estimator/report/waterfall.hpp"

namespace diastole::report {
namespace {

using namespace explain;

std::string set_words(const std::vector<std::string>& ids) {
  return ids.empty() ? "nothing" : fmt::format("{}", fmt::join(ids, " + "));
}

std::vector<std::string> ids_of(const std::vector<FoundEffect>& effects) {
  std::vector<std::string> ids;
  for (const FoundEffect& effect : effects)
    ids.push_back(effect.id);
  return ids;
}

std::string verdict_note(const Explanation& e) {
  switch (e.verdict) {
    case Verdict::named:
      return "named: no other set of known effects fits these data";
    case Verdict::ambiguous:
      return fmt::format("these data cannot tell {} sets apart", 1 + e.ambiguous_with.size());
    case Verdict::unexplained:
      return "something is there that no known effect removes";
    case Verdict::none:
      return "nothing exceeds the noise";
  }
  return "";
}

std::string verdict_words(const Explanation& e) {
  const std::string found = set_words(ids_of(e.effects));
  switch (e.verdict) {
    case Verdict::named:
      return found;
    case Verdict::ambiguous:
      return found + " or another";
    case Verdict::unexplained:
      return e.effects.empty() ? "unexplained" : found + ", and more";
    case Verdict::none:
      return "no effect missing";
  }
  return "";
}

void add_headlines(Page& page, const Explanation& e) {
  page.headline("What the model lacks", verdict_words(e), verdict_note(e));
  page.headline("Gap, before → after",
                fmt::format("{} → {}", number(e.gap.before, 3), number(e.gap.after, 3)),
                fmt::format("{} is noise; {} % closed on data that were not fitted", number(e.gap.floor, 3),
                            number(100 * e.gap.closed, 3)));
  if (e.shifts.empty()) return;
  const ParameterShift& first = e.shifts.front();
  page.headline(first.name, with_error(first.after, first.after_error),
                fmt::format("{} without what was added", with_error(first.before, first.before_error)));
}

/// "in segment 2, at 0.40 to 0.60 of the cycle, between 2 and 6 Hz".
std::string place_words(const Misfit& misfit) {
  std::string words;
  const auto add = [&words](const std::string& text) {
    words += fmt::format("{}{}", words.empty() ? "" : ", ", text);
  };
  if (misfit.segment) add(fmt::format("segment {}", *misfit.segment));
  if (misfit.phase) add(fmt::format("{:.2f} to {:.2f} of the cycle", (*misfit.phase)[0], (*misfit.phase)[1]));
  if (misfit.band_Hz)
    add(fmt::format("{} to {} Hz", number((*misfit.band_Hz)[0], 2), number((*misfit.band_Hz)[1], 2)));
  if (!misfit.region.empty()) add(misfit.region);
  return words.empty() ? "everywhere" : words;
}

void add_where(Page& page, const Explanation& e) {
  if (e.where.empty()) {
    page.paragraph("The base model misses nothing beyond the noise.");
    return;
  }
  const auto row_of = [](const Misfit& misfit) -> Page::Row {
    return {misfit.port,
            number(misfit.excess_chi2, 3),
            misfit.p_value < 1e-300 ? "< 1e−300" : number(misfit.p_value, 2),
            misfit.channel,
            misfit.run.empty() ? "–" : misfit.run,
            place_words(misfit)};
  };
  page.table_of(
      e.where, {"port", "excess χ²", "p", "channel", "run", "where"}, row_of,
      "Where the base model fails beyond the noise, after correction for how many places were looked at. "
      "Ports: "
      "drive (command to cavity volume), specimen (volume to pressure), sensor, clock, field (displacement).",
      3);
}

void add_effects(Page& page, const Explanation& e) {
  std::vector<std::vector<std::string>> rows;
  for (const FoundEffect& effect : e.effects) {
    for (const FoundParameter& parameter : effect.parameters) {
      rows.push_back({effect.id, with_error(parameter.value, parameter.standard_error),
                      fmt::format("{} to {}", number(parameter.ci90[0]), number(parameter.ci90[1])),
                      parameter.name});
    }
    for (const FoundChangePoint& point : effect.change_points)
      rows.push_back({effect.id, number(point.time_s) + " s", "", "moment in " + point.run});
  }
  if (!rows.empty()) {
    page.table({"effect", "value", "90 % interval", "parameter"}, rows, "What was added to the model.", 3);
  }
  for (const FoundEffect& effect : e.effects) {
    const Effect* known = find_effect(effect.id);
    if (known == nullptr) continue;
    page.paragraph(fmt::format("{}: {}. {}", effect.id, known->text().title, known->text().looks_like));
  }
  if (!e.ambiguous_with.empty()) {
    std::vector<std::string> sets;
    for (const auto& ids : e.ambiguous_with)
      sets.push_back(set_words(ids));
    page.warning(
        fmt::format("As good on these data: {}. Do not report the one above as found before an experiment "
                    "has told them apart.",
                    fmt::join(sets, "; or ")));
  }
}

void add_shifts(Page& page, const Explanation& e) {
  if (e.shifts.empty()) return;
  std::vector<std::vector<std::string>> rows;
  for (const ParameterShift& shift : e.shifts) {
    const double change = shift.before - shift.after;
    const bool is_zero = shift.name.ends_with("offset_Pa");  // of which nothing is a part
    const double off = is_zero ? change : 100 * change / shift.after;
    rows.push_back({shift.name, with_error(shift.before, shift.before_error),
                    with_error(shift.after, shift.after_error),
                    fmt::format("{}{} {}", off > 0 ? "+" : "", number(off, 2), is_zero ? "Pa" : "%")});
  }
  page.table({"parameter", "without", "with", "bias without"}, rows,
             "How far the estimates were off while the model lacked what was added.");
}

void add_evidence(Page& page, const Explanation& e) {
  if (e.evidence.empty()) return;
  page.section(
      "The evidence",
      "Each candidate's drop of −2 log likelihood (χ²) with the stiffness and the offsets free to adapt: by "
      "a full "
      "refit, or by a score test where that was too small to deserve one. A true effect also predicts runs "
      "that were not fitted.");
  const auto row_of = [](const Candidate& candidate) -> Page::Row {
    return {set_words(candidate.ids),
            number(candidate.chi_square_drop, 4),
            std::to_string(candidate.parameters),
            candidate.held_out_drop ? number(*candidate.held_out_drop, 4) : "–",
            candidate.refitted ? "refit" : "score test",
            candidate.verdict};
  };
  page.table_of(e.evidence, {"candidate", "χ² drop", "parameters", "on held-out runs", "by", "verdict"},
                row_of, "All candidates that were looked at.", 4);
}

void add_next(Page& page, const Explanation& e) {
  if (!e.next_experiment) return;
  const NextExperiment& next = *e.next_experiment;
  page.section("What to measure next", next.reason);
  page.paragraph(
      fmt::format("It is predicted to separate {} by {} standard deviations after everything free has "
                  "adapted.",
                  fmt::join(next.separates, " from "), number(next.predicted_separation_sigma, 2)));
  page.listing("The experiment file: save it and give it to diastole run", next.toml);
}

}  // namespace

void add_explanation(Page& page, const Explanation& e) {
  add_headlines(page, e);
  page.section("In words", e.summary.empty() ? verdict_note(e) + "." : e.summary);
  add_effects(page, e);
  add_shifts(page, e);
  if (!e.study_after.empty())
    page.paragraph(
        fmt::format("The study with what was added is in {}; every command takes it.", e.study_after));
  add_where(page, e);
  if (!e.steps.empty()) {
    page.section(
        "The gap, effect by effect",
        e.gap.held_out.empty()
            ? "Reduced chi-square after each step; noise alone gives 1."
            : fmt::format("Reduced chi-square after each step on {}, which no fit saw; noise alone gives 1.",
                          fmt::join(e.gap.held_out, ", ")));
    page.figures({{waterfall(e.steps, e.gap.floor),
                   "Blue: what is left; green: what the step took away. The scale is logarithmic."}});
  }
  add_explained_traces(page, e);
  add_explained_field(page, e);
  add_evidence(page, e);
  add_next(page, e);
}

}  // namespace diastole::report
