#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "estimator/report/explanation_views.hpp"
#include "estimator/report/field_views.hpp"
#include "estimator/report/heat_map.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/svg_plot.hpp"
#include "estimator/report/trace_views.hpp"

namespace diastole::report {
namespace {

using explain::Explanation;
using explain::Trace;

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
  return {plot.svg(),
          fmt::format("Pressure against the volume that the specimen takes, mean of {} cycles from {} s "
                      "of {}. Volumes are the augmented model's.",
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
  return {plot.svg(),
          fmt::format("What the models miss over the same cycles of {}: what is left after is noise if "
                      "it stays inside the band.",
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
  return {plot.svg(),
          fmt::format("In which frequencies the models miss {}. The floor is what equal cycles differ by "
                      "among themselves; no model can go below it.",
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
        fmt::format(
            "Measured − model in {}, cycle by cycle, in units of the noise of one sample. Upright stripes "
            "repeat in every cycle; what changes from top to bottom drifts or happened once.",
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
  for (const explain::FoundEffect& effect : explanation.effects) {
    std::map<std::string, double> value;
    for (const explain::FoundParameter& parameter : effect.parameters)
      value[parameter.name] = parameter.value;
    if (!value.contains("radius_mm") || !value.contains("z_mm") || !value.contains("theta_deg")) continue;
    const double theta = value["theta_deg"] * std::numbers::pi / 180.0;
    places.push_back(
        {value["radius_mm"] * std::cos(theta), value["radius_mm"] * std::sin(theta), value["z_mm"]});
  }
  return places;
}

}  // namespace

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
  page.section(
      "Measurement and model, before and after",
      "Before: the base model with its best stiffness and offsets. After: with the effects that were "
      "added. The recordings in which the base model is farthest off come first.");
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

void add_explained_field(Page& page, const Explanation& explanation) {
  if (explanation.field.empty()) return;
  const std::array<double, 2> rms = rms_of(explanation.field);
  const std::vector<std::array<double, 3>> inclusions = inclusions_mm(explanation);
  page.section(
      "Where in the wall",
      fmt::format(
          "{} residuals of tags or points, in units of their own errors: {} before and {} after, where 1 is "
          "noise alone. One tag tells little: the maps show how far the motion is off on the average over a "
          "lump's size, beside the noise of that average, again 1 where noise is all. Places are those of "
          "the "
          "undeformed body; holes hold too few.{}",
          explanation.field.size(), number(rms[0], 3), number(rms[1], 3),
          inclusions.empty() ? "" : " The ring is where the lump was found."));
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

}  // namespace diastole::report
