#include "estimator/explain/rig/findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>

#include "estimator/explain/rig/value_errors.hpp"
#include "estimator/inference/intervals.hpp"
#include "estimator/inference/tail_probability.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double discovery_rate = 0.01;

std::string file_of(const rig::SessionRun& run) { return run.drive.place.name + ".run.h5"; }

VectorXd rows_of(const rig::FeatureBlock& block, const VectorXd& all) {
  return all.segment(static_cast<Index>(block.first), static_cast<Index>(block.features.size()));
}

/// The narrowest part of the cycle that holds most of a block's misfit.
std::optional<std::array<double, 2>> phase_of(const rig::FeatureBlock& block, const VectorXd& left) {
  constexpr size_t bins = 10;
  constexpr double most = 0.7;
  if (block.cycles < 2.0) return {};
  const VectorXd series = rig::SegmentFeatures::series(block, left);
  std::array<double, bins> squares{};
  for (Index k = 0; k < series.size(); ++k) {
    const double turns = block.cycles * static_cast<double>(k) / static_cast<double>(series.size());
    squares[static_cast<size_t>((turns - std::floor(turns)) * bins)] += series[k] * series[k];
  }
  const double sum = std::accumulate(squares.begin(), squares.end(), 0.0);
  for (size_t width = 1; width <= bins; ++width)
    for (size_t first = 0; first + width <= bins; ++first)
      if (std::accumulate(squares.begin() + static_cast<std::ptrdiff_t>(first),
                          squares.begin() + static_cast<std::ptrdiff_t>(first + width), 0.0) >= most * sum)
        return std::array{static_cast<double>(first) / bins, static_cast<double>(first + width) / bins};
  return {};
}

/// The octave about the harmonic that holds most of a block's misfit.
std::optional<std::array<double, 2>> band_of(const rig::FeatureBlock& block, const VectorXd& left) {
  double largest = 0.0;
  double frequency = 0.0;
  for (size_t i = 0; i < block.features.size(); ++i) {
    const rig::Feature& feature = block.features[i];
    const double square = left[static_cast<Index>(i)] * left[static_cast<Index>(i)];
    if (feature.harmonic == 0.0 || square <= largest) continue;
    largest = square;
    frequency = feature.harmonic / block.period_s * (block.cycles > 1.0 ? 1.0 : 0.5);
  }
  if (frequency == 0.0) return {};
  return std::array{frequency / std::numbers::sqrt2, frequency * std::numbers::sqrt2};
}

/// 90 %, within the bounds of what the effect can be; all of them where the data do not determine the value.
std::array<double, 2> interval_of(const rig::Unknown& unknown, double coordinate, double sd) {
  if (!std::isfinite(sd)) return {unknown.lower, unknown.upper};
  const auto [low, high] = inference::interval(unknown, coordinate, inference::normal_90 * sd);
  return {std::isnan(low) ? unknown.lower : std::clamp(low, unknown.lower, unknown.upper),
          std::isnan(high) ? unknown.upper : std::clamp(high, unknown.lower, unknown.upper)};
}

Port port_of(const EffectSet& under, rig::Signal signal) {
  if (under.model.terms.size() == 1) return under.model.terms.front().effect->text().port;
  return signal == rig::Signal::pump ? Port::drive : Port::specimen;
}

}  // namespace

std::vector<FoundEffect> found_effects(const rig::SessionProblem& problem, const EffectSet& set,
                                       const SetVerdict& verdict) {
  std::vector<FoundEffect> effects;
  const VectorXd errors = value_errors(problem, set);
  size_t at = 0;
  for (size_t t = 0; t < set.model.terms.size(); ++t) {
    const rig::ModelTerm& term = set.model.terms[t];
    FoundEffect found;
    found.id = term.effect->text().id;
    found.size_over_model_error = verdict.size_over_error[t];
    for (const EffectParameter& parameter : term.effect->parameters()) {
      const rig::Unknown& unknown = set.unknowns[at];
      const double coordinate = unknown.coordinate(set.model.values[at]);
      const double sd = errors[static_cast<Index>(at)];
      found.parameters.push_back({std::string(parameter.name), set.model.values[at],
                                  inference::standard_error(unknown, coordinate, sd),
                                  interval_of(unknown, coordinate, sd), std::string(parameter.unit)});
      ++at;
    }
    for (const ChangePoint& change_point : term.change_points)
      found.change_points.push_back({change_point.run, change_point.time_s});
    if (verdict.material[t]) effects.push_back(std::move(found));
  }
  return effects;
}

std::vector<ParameterShift> parameter_shifts(const rig::SessionProblem& problem, const EffectSet& before,
                                             const EffectSet& after) {
  const auto value = [&](const EffectSet& set, size_t i) {
    const rig::Nuisance& nuisance = problem.nuisances()[i];
    const double v = nuisance.mean + nuisance.sd * set.model.nuisances[static_cast<Index>(i)];
    const Index row = set.covariance.rows() - set.model.nuisances.size() + static_cast<Index>(i);
    const double error = nuisance.sd * std::sqrt(set.covariance(row, row));
    return i == 0 ? std::pair(std::exp(v), std::exp(v) * error) : std::pair(v, error);
  };
  std::vector<ParameterShift> shifts;
  for (size_t i = 0; i < rig::basic_nuisances; ++i) {
    if (i == 2 && !problem.noise().channels.contains(rig::Channel::pump)) continue;
    const auto [old, old_error] = value(before, i);
    const auto [now, now_error] = value(after, i);
    shifts.push_back({i == 0 ? problem.family().modulus().name : problem.nuisances()[i].name + "_Pa", old,
                      old_error, now, now_error});
  }
  return shifts;
}

std::vector<Misfit> misfits(const rig::SessionProblem& problem, const EffectSet& set,
                            const EffectSet& under) {
  constexpr size_t most = 12;
  std::vector<Misfit> list;
  std::vector<double> p_values;
  for (const rig::FeatureBlock& block : problem.features().blocks()) {
    const VectorXd left = rows_of(block, set.evidence.left);
    const double square = left.cwiseAbs2().cwiseQuotient(rows_of(block, under.evidence.variance)).sum();
    const auto dofs = static_cast<double>(left.size());
    const rig::SessionRun& run = problem.session().runs[block.run];
    Misfit misfit;
    misfit.port = name_of(port_of(under, block.signal));
    misfit.run = file_of(run);
    misfit.channel = name_of(block.signal);
    misfit.segment = static_cast<int>(block.segment);
    misfit.phase = phase_of(block, left);
    misfit.band_Hz = band_of(block, left);
    misfit.excess_chi2 = square - dofs;
    misfit.p_value = inference::chi_square_tail(square, dofs);
    p_values.push_back(misfit.p_value);
    list.push_back(std::move(misfit));
  }
  const double limit = inference::discovery_limit(p_values, discovery_rate);
  std::erase_if(list, [&](const Misfit& misfit) { return misfit.p_value > limit; });
  std::ranges::sort(list, std::greater(), &Misfit::excess_chi2);
  list.resize(std::min(list.size(), most));
  return list;
}

Misfit misfit_of(const rig::Tone& tone, const rig::Session& session) {
  return {
      .port = std::string(name_of(Port::sensor)),
      .run = file_of(session.runs[tone.run]),
      .channel = std::string(name_of(rig::Signal::cavity)),
      .segment = static_cast<int>(tone.segment),
      .band_Hz = std::array{tone.frequency_Hz - tone.resolution_Hz, tone.frequency_Hz + tone.resolution_Hz},
      .excess_chi2 = tone.excess_chi2,
      .p_value = tone.p_value};
}

std::vector<Candidate> candidates(const EffectLibrary& known, const WeighedSets& search,
                                  const SetVerdict& verdict) {
  std::vector<Candidate> list;
  const auto plain = std::ranges::find_if(
      search.sets, [&](const EffectSet& set) { return set.model.terms.size() == search.given; });
  // Of a set in rigs of several tolerances the most probable, or the chosen one, stands for it.
  std::map<std::vector<std::string>, double> probability;
  for (size_t k = 0; k < search.sets.size(); ++k)
    probability[search.sets[k].ids()] += search.probability[k];
  std::set<std::vector<std::string>> reported{plain->ids()};
  for (size_t k = 0; k < search.sets.size(); ++k) {
    const EffectSet& set = search.sets[k];
    const EffectSet& chosen = search.sets[verdict.chosen];
    if ((k != verdict.chosen && set.ids() == chosen.ids()) || !reported.insert(set.ids()).second) continue;
    Candidate row{
        set.ids(), 2.0 * (set.log_posterior - plain->log_posterior), true, set.model.values.size(), {}, ""};
    if (k == verdict.chosen) {
      if (verdict.log_pseudo_bayes_factor) row.held_out_drop = 2.0 * *verdict.log_pseudo_bayes_factor;
      row.verdict = verdict.verdict == Verdict::unexplained ? "fits best, and not well enough"
                    : verdict.verdict == Verdict::ambiguous ? "as good"
                    : verdict.verdict == Verdict::named     ? "named"
                                                            : "a hint, too small for a name";
    } else {
      row.verdict = fmt::format("probability {:.2g}", probability[set.ids()]);
    }
    if (!inference::is_settled(set.termination)) row.verdict += "; its search was not brought to its end";
    list.push_back(std::move(row));
  }
  for (const auto& single : search.single_gains)
    if (std::ranges::none_of(list,
                             [&](const Candidate& row) { return row.ids == std::vector{single.first}; }))
      list.push_back({{single.first},
                      single.second,
                      false,
                      known.find(single.first)->parameters().size(),
                      {},
                      "promises too little"});
  return list;
}

std::vector<Trace> traces(const rig::SessionProblem& problem, const EffectSet& before,
                          const EffectSet& after) {
  constexpr size_t kept = 4;  // every so many samples are shown
  std::vector<Trace> list;
  for (size_t r = 0; r < problem.session().runs.size(); ++r) {
    const rig::SessionRun& run = problem.session().runs[r];
    const rig::Prediction old = problem.predict_run(r, before.model).pressures;
    const rig::Prediction now = problem.predict_run(r, after.model).pressures;
    for (const auto& [channel, noise] : problem.noise().channels) {
      if (!run.pressure_kPa.contains(channel)) continue;
      Trace trace;
      trace.run = file_of(run);
      trace.channel = rig::name_of(channel);
      trace.unit = "kPa";
      trace.noise_sd = noise.sd_kPa;
      trace.trigger_s = run.drive.place.trigger_s;
      const bool cavity = channel == rig::Channel::cavity;
      for (size_t k = 0; k < run.sample_s.size(); k += kept) {
        trace.time_s.push_back(run.sample_s[k]);
        trace.measured.push_back(run.pressure_kPa.at(channel)[k]);
        trace.before.push_back(cavity ? old.cavity_kPa[k] : old.pump_kPa[k]);
        trace.after.push_back(cavity ? now.cavity_kPa[k] : now.pump_kPa[k]);
        if (cavity) trace.cavity_mL.push_back(run.drive.motion.at(run.sample_s[k]).volume_mL);
      }
      list.push_back(std::move(trace));
    }
  }
  return list;
}

}  // namespace diastole::explain
