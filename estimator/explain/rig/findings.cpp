#include "estimator/explain/rig/findings.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "estimator/effects/effect.hpp"
#include "estimator/inference/covariance.hpp"
#include "estimator/inference/intervals.hpp"

namespace diastole::explain {
namespace {

Port port_of(std::string_view channel) { return channel == "pump_kPa" ? Port::drive : Port::specimen; }

}  // namespace

std::vector<double> parameter_errors(const rig::RigFit& fit, const Eigen::VectorXd& weights,
                                     double explained) {
  constexpr double looks_alike =
      2e-3;  // of a change: the model's error of it that its parameters can take up
  const double with_models = std::sqrt(1.0 + looks_alike * looks_alike * std::max(explained, 0.0));
  std::vector<bool> is_free;
  for (const double error : fit.errors)
    is_free.push_back(error > 0.0);
  const Eigen::VectorXd variance =
      inference::estimate_covariance(weights.cwiseSqrt().asDiagonal() * fit.jacobian, is_free)
          .matrix.diagonal();
  std::vector<double> errors;
  for (size_t i = 0; i < fit.values.size(); ++i) {
    const double sd = with_models * std::sqrt(variance[static_cast<Eigen::Index>(i)]);
    errors.push_back(
        inference::standard_error(fit.unknowns[i], fit.unknowns[i].coordinate(fit.values[i]), sd));
  }
  return errors;
}

std::vector<FoundEffect> found_effects(const rig::RigFit& fit, const std::vector<double>& errors) {
  std::vector<FoundEffect> effects;
  size_t at = rig::nuisances;
  for (const rig::ModelTerm& term : fit.terms) {
    FoundEffect found;
    found.id = term.effect->text().id;
    for (const EffectParameter& parameter : term.effect->parameters()) {
      const rig::Unknown& unknown = fit.unknowns[at];
      const double coordinate = unknown.coordinate(fit.values[at]);
      const double sd = errors[at] / std::abs(unknown.slope(coordinate));
      found.parameters.push_back({std::string(parameter.name), fit.values[at], errors[at],
                                  inference::interval(unknown, coordinate, inference::normal_90 * sd)});
      ++at;
    }
    for (const ChangePoint& change_point : term.change_points)
      found.change_points.push_back({change_point.run, change_point.time_s});
    effects.push_back(std::move(found));
  }
  return effects;
}

std::vector<ParameterShift> parameter_shifts(const rig::RigFit& before,
                                             const std::vector<double>& before_errors,
                                             const rig::RigFit& after,
                                             const std::vector<double>& after_errors) {
  std::vector<ParameterShift> shifts;
  for (size_t i = 0; i < rig::nuisances; ++i) {
    if (before_errors[i] == 0.0 && after_errors[i] == 0.0) continue;
    const std::string name = i == 0 ? "C1_kPa" : before.unknowns[i].name;
    shifts.push_back({name, before.values[i], before_errors[i], after.values[i], after_errors[i]});
  }
  return shifts;
}

namespace {

/// The widest run of phase bins that hold most of the excess.
std::optional<std::array<double, 2>> phase_of(const std::vector<const ResidualCell*>& cells) {
  constexpr double most = 0.7;
  std::array<double, phase_bins> excess{};
  double sum = 0.0;
  for (const ResidualCell* cell : cells) {
    if (!cell->phase) continue;
    const auto bin = static_cast<size_t>(std::lround((*cell->phase)[0] * phase_bins));
    excess[bin] += std::max(cell->excess(), 0.0);
    sum += std::max(cell->excess(), 0.0);
  }
  if (!(sum > 0.0)) return {};
  for (size_t width = 1; width <= phase_bins; ++width) {
    for (size_t first = 0; first + width <= phase_bins; ++first) {
      double part = 0.0;
      for (size_t bin = first; bin < first + width; ++bin)
        part += excess[bin];
      if (part >= most * sum)
        return std::array{static_cast<double>(first) / phase_bins,
                          static_cast<double>(first + width) / phase_bins};
    }
  }
  return {};
}

/// The effect whose leaving-out raises a block's squares most.
std::string port_at(const rig::ResidualBlock& block, const std::vector<const rig::RigFit*>& without,
                    const rig::RigFit& after) {
  double largest = 0.0;
  const Effect* effect = nullptr;
  for (size_t member = 0; member < after.terms.size(); ++member) {
    const rig::RigFit* other = member < without.size() ? without[member] : nullptr;
    if (after.terms.size() == 1) {
      effect = after.terms.front().effect;
      break;
    }
    if (other == nullptr) continue;
    const auto first = static_cast<Eigen::Index>(block.first);
    const auto count = static_cast<Eigen::Index>(block.count);
    const double rise = other->residuals.segment(first, count).squaredNorm() -
                        after.residuals.segment(first, count).squaredNorm();
    if (rise > largest) {
      largest = rise;
      effect = after.terms[member].effect;
    }
  }
  return std::string(name_of(effect != nullptr ? effect->text().port : port_of(block.channel)));
}

}  // namespace

std::vector<Misfit> misfits(const rig::Session& session, const rig::RigProblem& problem,
                            const std::vector<ResidualCell>& cells,
                            const std::vector<const rig::RigFit*>& without, const rig::RigFit& after) {
  constexpr size_t most = 12;
  using Key = std::tuple<size_t, std::string, int>;
  std::map<Key, std::vector<const ResidualCell*>> groups;
  std::map<std::pair<size_t, std::string>, const ResidualCell*> bands;
  for (const ResidualCell& cell : cells) {
    if (cell.kind == CellKind::band) {
      const ResidualCell*& band = bands[{cell.run, cell.channel}];
      if (band == nullptr || cell.excess() / cell.dofs > band->excess() / band->dofs) band = &cell;
    } else {
      groups[{cell.run, cell.channel, cell.segment.value_or(-1)}].push_back(&cell);
    }
  }
  for (const auto& [place, band] : bands) {  // a band that no phase or rest tells of
    const bool told = std::any_of(groups.begin(), groups.end(), [&, &at = place](const auto& group) {
      return std::get<0>(group.first) == at.first && std::get<1>(group.first) == at.second;
    });
    if (!told) groups[{place.first, place.second, -1}].push_back(band);
  }
  std::vector<Misfit> list;
  for (const auto& [key, members] : groups) {
    const auto& [run, channel, segment] = key;
    Misfit misfit;
    misfit.run = session.runs[run].drive.place.name + ".run.h5";
    misfit.channel = channel;
    if (segment >= 0) misfit.segment = segment;
    misfit.phase = phase_of(members);
    if (const auto band = bands.find({run, channel}); band != bands.end())
      misfit.band_Hz = band->second->band_Hz;
    for (const ResidualCell* cell : members) {
      misfit.p_value = std::min(misfit.p_value, cell->p_value);
      misfit.excess_chi2 = std::max(misfit.excess_chi2, 0.0);
      if (cell->kind != CellKind::shape && cell->kind != CellKind::cycles)
        misfit.excess_chi2 += cell->excess();
    }
    if (misfit.excess_chi2 == 0.0)
      for (const ResidualCell* cell : members)
        misfit.excess_chi2 += cell->excess();
    for (const rig::ResidualBlock& block : problem.blocks())
      if (block.run == run && block.channel == channel) misfit.port = port_at(block, without, after);
    list.push_back(std::move(misfit));
  }
  std::sort(list.begin(), list.end(),
            [](const Misfit& a, const Misfit& b) { return a.excess_chi2 > b.excess_chi2; });
  list.resize(std::min(list.size(), most));
  return list;
}

SearchRecord record_of(const SearchResult& search) {
  SearchRecord record{.sets = {}, .best = search.best, .screened = {}};
  for (const FittedSet& set : search.sets)
    record.sets.push_back({set.ids(), set.chi_square, set.parameters(), set.fit.termination});
  for (const Lead& lead : search.leads)
    record.screened.push_back(
        {std::string(lead.term.effect->text().id), lead.gain, lead.visibility, lead.parameters});
  return record;
}

std::vector<Trace> traces(const rig::Session& session, const rig::RigProblem& problem,
                          const rig::RigFit& before, const rig::RigFit& after) {
  constexpr size_t kept = 4;  // every so many samples are shown
  const auto old = problem.predictions(before);
  const auto now = problem.predictions(after);
  std::vector<Trace> list;
  for (size_t r = 0; r < session.runs.size(); ++r) {
    const rig::SessionRun& run = session.runs[r];
    for (const auto& [channel, noise] : problem.noise().channels) {
      Trace trace;
      trace.run = run.drive.place.name + ".run.h5";
      trace.channel = name_of(channel);
      trace.unit = "kPa";
      trace.noise_sd = noise.sd_kPa;
      trace.trigger_s = run.drive.place.trigger_s;
      const bool cavity = channel == rig::Channel::cavity;
      for (size_t k = 0; k < run.sample_s.size(); k += kept) {
        trace.time_s.push_back(run.sample_s[k]);
        trace.measured.push_back(run.pressure_kPa.at(channel)[k]);
        trace.before.push_back(cavity ? old[r].cavity_kPa[k] : old[r].pump_kPa[k]);
        trace.after.push_back(cavity ? now[r].cavity_kPa[k] : now[r].pump_kPa[k]);
        if (cavity) trace.cavity_mL.push_back(run.drive.motion.at(run.sample_s[k]).volume_mL);
      }
      list.push_back(std::move(trace));
    }
  }
  return list;
}

}  // namespace diastole::explain
