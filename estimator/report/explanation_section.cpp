#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "estimator/effects/effect.hpp"
#include "estimator/explain/verdict/verdict.hpp"
#include "estimator/report/explanation_drawings.hpp"
#include "estimator/report/field_views.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/sections.hpp"
#include "estimator/report/svg_plot.hpp"
#include "estimator/report/trace_views.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole::report {
namespace {

using namespace explain;

constexpr size_t most_traces = 3;  // drawn in full; the others are rows of a table
constexpr size_t phases = 60;

std::string named(const Trace& trace) { return trace.channel + " of " + trace.run; }

std::string axis_of(const Trace& trace) {
  return (trace.unit == "mL" ? "volume (" : "pressure (") + trace.unit + ")";
}

Figure loop_figure(const Trace& trace, const MeanCycle& mean) {
  SvgPlot plot({.x = {.label = "cavity volume (mL)"}, .y = {.label = axis_of(trace)}});
  const auto closed = [](std::vector<double> values) {
    values.push_back(values.front());
    return values;
  };
  const auto volume_mL = closed(mean.cavity_mL);
  plot.line(volume_mL, closed(mean.before), "b dashed", "model before");
  plot.line(volume_mL, closed(mean.after), "c", "model after");
  plot.points(mean.cavity_mL, mean.measured, "a small", "measured");
  return {plot.svg(), fmt::format("Pressure against the volume that the specimen takes, mean of {} cycles "
                                  "from {} s of {}. Volumes are the augmented model's.",
                                  mean.cycles, number(mean.start_s, 3), named(trace))};
}

Figure cycle_figure(const Trace& trace, const MeanCycle& mean) {
  const double period_s = mean.time_s.back() + mean.time_s.front();
  SvgPlot plot({.x = {.label = "time after the trigger (s)", .from = 0.0, .to = period_s},
                .y = {.label = "measured − model (" + trace.unit + ")"}});
  std::vector<double> before, after;
  for (size_t i = 0; i < mean.measured.size(); ++i) {
    before.push_back(mean.measured[i] - mean.before[i]);
    after.push_back(mean.measured[i] - mean.after[i]);
  }
  const std::vector<double> ends{0.0, period_s};
  const double twice = 2 * trace.noise_sd;
  plot.band(ends, std::vector<double>{-twice, -twice}, std::vector<double>{twice, twice}, "muted",
            "noise of one sample, ± 2 SD");
  plot.line(mean.time_s, before, "b", "before");
  plot.line(mean.time_s, after, "c", "after");
  return {plot.svg(), fmt::format("What the models miss over the same cycles of {}: what is left after is "
                                  "noise if it stays inside the band.",
                                  named(trace))};
}

/// Lines merged into bands of equal width on a logarithmic axis, by their mean power.
Spectrum by_bands(const Spectrum& lines) {
  constexpr double bands_a_decade = 25;
  Spectrum bands;
  for (size_t from = 0; from < lines.density.size();) {
    const double band = std::floor(bands_a_decade * std::log10(lines.frequency_Hz[from]));
    size_t to = from;
    double power = 0.0, frequency_Hz = 0.0;
    for (;
         to < lines.density.size() && std::floor(bands_a_decade * std::log10(lines.frequency_Hz[to])) == band;
         ++to) {
      power += lines.density[to] * lines.density[to];
      frequency_Hz += lines.frequency_Hz[to];
    }
    const auto count = static_cast<double>(to - from);
    bands.frequency_Hz.push_back(frequency_Hz / count);
    bands.density.push_back(std::sqrt(power / count));
    from = to;
  }
  return bands;
}

Figure spectrum_figure(const Trace& trace) {
  SvgPlot plot({.x = {.label = "frequency (Hz)", .logarithmic = true},
                .y = {.label = "residual (" + trace.unit + "/√Hz)", .logarithmic = true}});
  const Spectrum floor = by_bands(repeat_spectrum(trace));
  const Spectrum before = by_bands(residual_spectrum(trace, trace.before));
  const Spectrum after = by_bands(residual_spectrum(trace, trace.after));
  if (!floor.density.empty())
    plot.line(floor.frequency_Hz, floor.density, "muted heavy", "floor: cycle against cycle");
  plot.line(before.frequency_Hz, before.density, "b", "before");
  plot.line(after.frequency_Hz, after.density, "c", "after");
  return {plot.svg(), fmt::format("In which frequencies the models miss {}. The floor is what equal cycles "
                                  "differ by among themselves; no model can go below it.",
                                  named(trace))};
}

void add_heat_map(Page& page, const Trace& trace) {
  const CellGrid before = residual_grid(trace, trace.before, phases);
  const auto cycles = static_cast<double>(before.size());
  page.figures(
      {{heat_map(before, residual_grid(trace, trace.after, phases),
                 {.x = "part of the cycle",
                  .y = "cycle",
                  .bar = "residual / noise",
                  .x_range = {0, 1},
                  .y_range = {0, cycles}}),
        fmt::format("Measured − model in {}, cycle by cycle, in units of the noise of one sample. Upright "
                    "stripes repeat in every cycle; what changes from top to bottom drifts or happened once.",
                    named(trace))}});
}

void add_trace(Page& page, const Trace& trace) {
  page.time_chart(
      {.time_s = trace.time_s,
       .traces = {{"measured", "a", trace.measured},
                  {"model before", "b", trace.before},
                  {"model after", "c", trace.after}},
       .y_label = axis_of(trace),
       .marks_s = trace.trigger_s,
       .caption = fmt::format("{}. Dashed: triggers. Drag to zoom, double-click to return.", named(trace))});
  const MeanCycle mean = worst_mean_cycle(trace, phases);
  std::vector<Figure> row;
  if (mean.time_s.size() > 1) {
    if (!mean.cavity_mL.empty() && trace.unit == "kPa") row.push_back(loop_figure(trace, mean));
    row.push_back(cycle_figure(trace, mean));
  }
  row.push_back(spectrum_figure(trace));
  page.figures(row);
  add_heat_map(page, trace);
}

std::vector<std::array<double, 3>> inclusions_mm(const Explanation& explanation) {
  std::vector<std::array<double, 3>> places;
  for (const FoundEffect& effect : explanation.effects) {
    std::map<std::string, double> value;
    for (const FoundParameter& parameter : effect.parameters)
      value[parameter.name] = parameter.value;
    if (!value.contains("radius_mm") || !value.contains("z_mm") || !value.contains("theta_deg")) continue;
    const double theta = value["theta_deg"] * rad_per_deg;
    places.push_back(
        {value["radius_mm"] * std::cos(theta), value["radius_mm"] * std::sin(theta), value["z_mm"]});
  }
  return places;
}

/// A table of all recordings; of the worst few traces, loops, residuals of the mean cycle, spectra and maps of the
/// residual by phase and cycle. Nothing if there are no traces.
void add_explained_traces(Page& page, const Explanation& explanation) {
  std::vector<const Trace*> traces;
  for (const Trace& trace : explanation.traces) {
    if (!trace.time_s.empty() && trace.noise_sd > 0) traces.push_back(&trace);
  }
  if (traces.empty()) return;
  std::ranges::stable_sort(traces, std::greater{}, [](const Trace* trace) {
    const double misfit = misfit_in_noise(*trace, trace->before);
    return std::isfinite(misfit) ? misfit : -1.0;
  });
  page.section("Measurement and model, before and after",
               "Before: the base model with its best stiffness and offsets. After: with the effects that "
               "were added. The recordings in which the base model is farthest off come first.");
  std::vector<std::vector<std::string>> rows;
  for (const Trace* trace : traces) {
    const bool held = std::ranges::count(explanation.gap.held_out, trace->run) > 0;
    rows.push_back({named(*trace), number(trace->noise_sd, 2) + " " + trace->unit,
                    number(misfit_in_noise(*trace, trace->before), 3),
                    number(misfit_in_noise(*trace, trace->after), 3), held ? "held out" : ""});
  }
  page.table({"recording", "noise (SD)", "misfit / noise before", "after", ""}, rows,
             "Root mean square of measured − model over the noise of one sample: 1 is a perfect model.", 4);
  for (size_t i = 0; i < std::min(most_traces, traces.size()); ++i)
    add_trace(page, *traces[i]);
}

/// Maps of the tags' or points' residuals. Nothing if there are none.
void add_explained_field(Page& page, const Explanation& explanation) {
  if (explanation.field.empty()) return;
  const std::array<double, 2> rms = rms_of(explanation.field);
  const std::vector<std::array<double, 3>> inclusions = inclusions_mm(explanation);
  page.section(
      "Where in the wall",
      fmt::format("{} residuals of tags or points, in units of their own errors: {} before and {} after, "
                  "where 1 is noise alone. One tag tells little: the maps show how far the motion is off on "
                  "the average over a inclusion's size, beside the noise of that average, again 1 where "
                  "noise is all. Places are those of the undeformed body; holes hold too few.{}",
                  explanation.field.size(), number(rms[0], 3), number(rms[1], 3),
                  inclusions.empty() ? "" : " The ring is where the inclusion was found."));
  for (const FieldView& view : field_views(explanation.field, inclusions)) {
    page.figures({{heat_map(view.before, view.after,
                            {.x = "angle about the axis (degrees)",
                             .y = view.y_label,
                             .bar = "misfit / noise",
                             .x_range = {-180, 180},
                             .y_range = view.y_range,
                             .is_signed = false,
                             .marks = view.marks}),
                   view.title + "."}});
  }
}

std::string verdict_note(const Explanation& e) {
  switch (e.verdict) {
    case Verdict::named:
      return "named: no other set of known effects fits these data";
    case Verdict::ambiguous:
      return may_be_nothing(e)
                 ? "too weak to name and too strong to be chance"
                 : fmt::format("these data cannot tell {} sets apart", 1 + e.ambiguous_with.size());
    case Verdict::unexplained:
      return "something is there that no known effect removes";
    case Verdict::none:
      return e.model_error ? "nothing exceeds the model's own error" : "nothing exceeds the noise";
  }
  return "";
}

std::string verdict_words(const Explanation& e) {
  const std::string found = words_of(ids_of(e.effects), "nothing");
  switch (e.verdict) {
    case Verdict::named:
      return found;
    case Verdict::ambiguous:
      return found + (may_be_nothing(e) ? " or nothing" : " or another");
    case Verdict::unexplained:
      return e.effects.empty() ? "unexplained" : found + ", and more";
    case Verdict::none:
      return "no effect missing";
  }
  return "";
}

void add_headlines(Page& page, const Explanation& e) {
  page.headline(
      "What the model lacks", verdict_words(e),
      e.confidence ? fmt::format("{}; probability {:.2f}", verdict_note(e), *e.confidence) : verdict_note(e));
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
  page.table_of(e.where, {"port", "excess χ²", "p", "channel", "run", "where"}, row_of,
                "Where the base model fails beyond the noise, after correction for how many places were "
                "looked at. Ports: drive (command to cavity volume), specimen (volume to pressure), sensor, "
                "clock, field (displacement).",
                3);
}

void add_effects(Page& page, const Explanation& e) {
  std::vector<std::vector<std::string>> rows;
  for (const FoundEffect& effect : e.effects) {
    for (const FoundParameter& parameter : effect.parameters) {
      const std::string value = with_error(parameter.value, parameter.standard_error);
      rows.push_back({effect.id, parameter.unit.empty() ? value : value + " " + parameter.unit,
                      fmt::format("{} to {}", number(parameter.ci90[0]), number(parameter.ci90[1])),
                      effect.size_over_model_error ? number(*effect.size_over_model_error, 2) : "–",
                      parameter.name});
    }
    for (const FoundChangePoint& point : effect.change_points)
      rows.push_back({effect.id, number(point.time_s) + " s", "", "", "moment in " + point.run});
  }
  if (!rows.empty()) {
    page.table({"effect", "value", "90 % interval", "size / model's error", "parameter"}, rows,
               "What was added to the model. Its size is the RMS of what it changes, stiffness and offsets "
               "having followed, over that of the model's own error.",
               4);
  }
  for (const FoundEffect& effect : e.effects) {
    const Effect* known = find_effect(effect.id);
    if (known == nullptr) continue;
    page.paragraph(fmt::format("{}: {}. {}", effect.id, known->text().title, known->text().looks_like));
  }
  if (!e.ambiguous_with.empty()) {
    std::vector<std::string> sets;
    for (const auto& ids : e.ambiguous_with)
      sets.push_back(words_of(ids, "nothing"));
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

std::string channel_unit(const std::string& channel) { return channel.ends_with("_mL") ? "mL" : "Pa"; }

Page::Row departure_row(const Departure& part) {
  const std::string offset = part.unit == "ln" ? fmt::format("{:+.2g} %", 100.0 * std::expm1(part.offset))
                                               : fmt::format("{:+.2g} {}", part.offset, part.unit);
  return {part.part, offset, fmt::format("{:+.1f}", part.sds)};
}

/// What the model gets wrong by itself, what the rig's references left, the tolerances that the fit used, and hints.
void add_model_error(Page& page, const Explanation& e) {
  if (!e.model_error) return;
  page.section("How wrong the model is by itself",
               fmt::format("{} Pa in the cavity's pressure, {} % of its range ({}). What is smaller is no "
                           "finding: it may be the model's own error.",
                           number(e.model_error->rms_Pa, 2), number(e.model_error->percent_of_range, 2),
                           e.model_error->source == "reference" ? "learnt from the rig's references"
                           : e.model_error->source == "estimated"
                               ? "estimated from how the waveforms predict each other"
                               : "as stated for rigs of its kind"));
  if (e.reference) {
    const auto row_of = [](const ReferenceMisfit& misfit) -> Page::Row {
      return {misfit.channel, fmt::format("{} {}", number(misfit.rms, 2), channel_unit(misfit.channel)),
              number(misfit.percent_of_range, 2) + " %"};
    };
    page.table_of(
        e.reference->channels, {"channel", "RMS misfit", "of the range"}, row_of,
        fmt::format("What the model leaves on the rig's {} in which nothing is wrong.",
                    e.reference->sessions == 1 ? "reference"
                                               : std::to_string(e.reference->sessions) + " references"));
    if (!e.reference->departures.empty())
      page.table_of(e.reference->departures, {"part", "offset", "standard deviations"}, departure_row,
                    "Parts of the rig that the references show to be other than declared.");
  }
  if (!e.hints.empty()) {
    const auto row_of = [](const Hint& hint) -> Page::Row {
      return {hint.id, number(hint.size_over_model_error, 2), fmt::format("{:.2f}", hint.probability)};
    };
    page.table_of(e.hints, {"hint", "size / model's error", "probability"}, row_of,
                  "Significant, and not larger than what the model gets wrong by itself: no findings.");
  }
  if (!e.departures.empty())
    page.table_of(e.departures, {"part", "offset", "standard deviations"}, departure_row,
                  "What the fit takes to be other than declared, within what such parts may be.");
  if (!e.cycle_scatter.empty()) {
    const auto row_of = [](const CycleScatter& scatter) -> Page::Row {
      return {scatter.channel, number(scatter.rms_Pa, 2) + " Pa", number(scatter.noise_Pa, 2) + " Pa",
              number(scatter.percent_of_range, 2) + " %"};
    };
    page.table_of(e.cycle_scatter, {"channel", "beyond the noise", "noise", "of the range"}, row_of,
                  "How equal cycles differ from each other, RMS up to 12 Hz: no model of a repeated motion "
                  "explains it.");
  }
}

void add_evidence(Page& page, const Explanation& e) {
  if (e.evidence.empty()) return;
  page.section(
      "The evidence",
      "What each candidate gains with the stiffness and all else that is unknown free to adapt: twice "
      "the gain of ln probability of a rig's, the drop of χ² of an imaged specimen's; by a full "
      "refit, or linearised where that was too small to deserve one. A true effect also predicts what "
      "was not fitted.");
  const auto row_of = [](const Candidate& candidate) -> Page::Row {
    return {words_of(candidate.ids, "nothing"),
            number(candidate.chi_square_drop, 4),
            std::to_string(candidate.parameters),
            candidate.held_out_drop ? number(*candidate.held_out_drop, 4) : "–",
            candidate.refitted ? "refit" : "score test",
            candidate.verdict};
  };
  page.table_of(e.evidence, {"candidate", "χ² drop", "parameters", "on held-out runs", "by", "verdict"},
                row_of, "All candidates that were looked at.", 4);
}

/// The learned law's curve with its band.
void add_learned(Page& page, const Explanation& e) {
  if (!e.learned) return;
  const LearnedTerm& term = *e.learned;
  page.section(
      "A law that was learnt",
      fmt::format("A suggestion, no finding: at the port {}, {} depends on {} as drawn. Fitted on some "
                  "waveforms it predicts the others: the gap there goes from {} to {} ({} % closed).",
                  term.port, term.sets, fmt::join(term.variables, " and "), number(term.gap.before, 3),
                  number(term.gap.after, 3), number(100 * term.gap.closed, 3)));
  const auto at = [](size_t i) { return [i](const std::array<double, 2>& pair) { return pair[i]; }; };
  const std::vector<double> x = numbers_of(term.curve, at(0));
  SvgPlot plot({.x = {.label = fmt::format("{} ({})", term.variables.front(), term.variable_unit)},
                .y = {.label = fmt::format("the law ({})", term.unit)}});
  plot.band(x, numbers_of(term.band, at(0)), numbers_of(term.band, at(1)), "c", "90 % band");
  plot.line(x, numbers_of(term.curve, at(1)), "c", "learnt");
  page.figures(
      {{plot.svg(), fmt::format("What {} gets more or less, by {}.{}", term.sets, term.variables.front(),
                                term.closed_form.empty() ? "" : " Within the band: " + term.closed_form)}});
  for (const std::string& reading : term.readings)
    page.paragraph("Perhaps: " + reading + ".");
  for (const LearnedRival& rival : term.rivals)
    page.warning(fmt::format("As good on these waveforms: at the port {}, {} by {}.", rival.port, rival.sets,
                             fmt::join(rival.variables, " and ")));
  const auto row_of = [](const ParameterShift& shift) -> Page::Row {
    return {shift.name, with_error(shift.before, shift.before_error),
            with_error(shift.after, shift.after_error)};
  };
  page.table_of(term.shifts, {"parameter", "without", "with"}, row_of,
                "What the law does to the estimates: a free curve takes part of what the modulus was, and "
                "widens its error.");
}

void add_next(Page& page, const Explanation& e) {
  if (!e.next_experiment) return;
  const NextExperiment& next = *e.next_experiment;
  page.section("What to measure next", next.reason);
  page.paragraph(fmt::format(
      "It is predicted to separate {} by {} standard deviations after everything free has adapted.",
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
  add_model_error(page, e);
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
  add_learned(page, e);
  add_next(page, e);
}

}  // namespace diastole::report
