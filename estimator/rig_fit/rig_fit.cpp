#include "estimator/rig_fit/rig_fit.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "estimator/fe/parallel_for.hpp"
#include "estimator/rig/sampled_signal.hpp"
#include "estimator/rig_fit/search_scale.hpp"

namespace diastole::rig {
namespace {

constexpr size_t nuisances = 3;
constexpr double offset_reach_Pa = 2000.0;

/// Mean over the cycles of what the plant's volume was at each phase.
std::vector<double> gated(const GatedVolume& volume, const PlantTrace& plant) {
  std::vector<double> mean;
  for (const double phase : volume.measured.phase_s) {
    double sum = 0.0;
    for (const double trigger : volume.trigger_s)
      sum += sampled(plant.cavity_mL, (trigger + phase - plant.start_s) / plant.step_s);
    mean.push_back(sum / static_cast<double>(volume.trigger_s.size()));
  }
  return mean;
}

double sample_rate_Hz(const SessionRun& run) {
  return static_cast<double>(run.sample_s.size() - 1) / (run.sample_s.back() - run.sample_s.front());
}

/// Strokes larger by `part` in every second cycle, fading over the window in which accelerations are spread.
void vary_cycles(const SessionRun& run, size_t parity, double part, DriveTrace& trace) {
  const std::vector<CycleRows> cycles = cycles_of(run);
  const double fade_s = std::max(run.drive.motion.spread_s(), trace.step_s);
  for (size_t c = parity; c < cycles.size(); c += 2) {
    const double start_s = run.sample_s[cycles[c].first];
    const double end_s = run.sample_s[cycles[c].last - 1] + 1.0 / sample_rate_Hz(run);
    const double least_mL = run.drive.motion.at(start_s).volume_mL;
    for (size_t k = 0; k < trace.volume_mL.size(); ++k) {
      const double within = std::min(trace.time_s(k) - start_s, end_s - trace.time_s(k)) / fade_s + 0.5;
      const double larger = part * std::clamp(within, 0.0, 1.0);
      trace.volume_mL[k] += larger * (trace.volume_mL[k] - least_mL);
      trace.flow_mL_per_s[k] *= 1.0 + larger;
      trace.acceleration_mL_per_s2[k] *= 1.0 + larger;
    }
  }
}

/// Means over a tenth of a second: what is slower than the line's resonances, in which a fit from afar would be lost.
std::vector<double> smoothed(const ChannelNoise& noise, const std::vector<double>& values) {
  constexpr size_t window = 30;
  std::vector<double> means(values.size(), 0.0);
  double sum = 0.0;
  for (size_t k = 0; k < values.size(); ++k) {
    sum += std::isfinite(values[k]) ? values[k] : 0.0;
    if (k >= window) sum -= std::isfinite(values[k - window]) ? values[k - window] : 0.0;
    if (k + 1 >= window) means[k] = sum / static_cast<double>(window) / noise.sd_kPa;
  }
  return means;
}

bool is_missing(double value) { return !std::isfinite(value); }

}  // namespace

double RigFit::value(std::string_view name) const {
  for (size_t i = 0; i < unknowns.size(); ++i)
    if (unknowns[i].name == name) return values[i];
  return std::numeric_limits<double>::quiet_NaN();
}

RigProblem::RigProblem(const Session& session, const SpecimenFamily& family, const RigFitOptions& options)
    : session_(session), family_(family), options_(options), noise_(estimate_noise(session)) {
  set_blocks();
  base_ = fit_from({}, {family.modulus_start_kPa(), 0.0, 0.0});
  set_beats();
  base_ = fit_from({}, base_.values);
}

void RigProblem::set_blocks() {
  for (size_t r = 0; r < session_.runs.size(); ++r) {
    const SessionRun& run = session_.runs[r];
    for (const auto& [channel, noise] : noise_.channels) {
      const auto& values = run.pressure_kPa.at(channel);
      blocks_.push_back({r, std::string(name_of(channel)), rows_, values.size()});
      rows_ += values.size();
      missing_ += noise.autoregression.size();
      missing_ += static_cast<size_t>(std::count_if(values.begin(), values.end(), is_missing));
    }
    size_t gated_rows = 0;
    for (const GatedVolume& volume : run.volumes)
      gated_rows += volume.measured.phase_s.size();
    if (gated_rows > 0) blocks_.push_back({r, "cavity_mL", rows_, gated_rows});
    rows_ += gated_rows;
  }
}

std::vector<Unknown> RigProblem::unknowns(const std::vector<Ingredient>& ingredients) const {
  std::vector<Unknown> list{
      {"modulus_kPa", 0.2 * family_.modulus().lower, 5.0 * family_.modulus().upper},
      {"cavity_offset_Pa", -offset_reach_Pa, offset_reach_Pa},
      {"pump_offset_Pa", -offset_reach_Pa, offset_reach_Pa},
  };
  for (const Ingredient& ingredient : ingredients) {
    for (const EffectParameter& parameter : ingredient.effect->parameters()) {
      list.push_back({std::string(ingredient.effect->text().id) + "." + std::string(parameter.name),
                      parameter.lower, parameter.upper});
    }
  }
  return list;
}

RigModel RigProblem::model(const std::vector<Ingredient>& ingredients,
                           const std::vector<double>& values) const {
  RigModel model = session_.base;
  model.curve = family_.plain();
  model.modulus_kPa = values[0];
  model.cavity_offset_kPa = 1e-3 * values[1];
  model.pump_offset_kPa = 1e-3 * values[2];
  size_t at = nuisances;
  for (const Ingredient& ingredient : ingredients) {
    const size_t count = ingredient.effect->parameters().size();
    ingredient.effect->apply({values.data() + at, count}, {family_, ingredient.occasions}, model);
    at += count;
  }
  return model;
}

std::vector<PlantTrace> RigProblem::plants(const RigModel& model) const {
  std::vector<PlantTrace> traces(session_.runs.size());
  parallel_for(traces.size(), options_.threads, [&](size_t r) {
    traces[r] = simulate_plant(model, session_.runs[r].drive, options_.simulation);
  });
  return traces;
}

void RigProblem::add_channel(const SessionRun& run, Channel channel, const std::vector<double>& predicted,
                             size_t first, Look look, Eigen::VectorXd& out) const {
  const auto& measured = run.pressure_kPa.at(channel);
  std::vector<double> difference(measured.size());
  for (size_t k = 0; k < measured.size(); ++k)
    difference[k] = measured[k] - predicted[k];
  const ChannelNoise& noise = noise_.channels.at(channel);
  const std::vector<double> white =
      look == Look::fine ? whitened(noise, difference) : smoothed(noise, difference);
  for (size_t k = 0; k < white.size(); ++k)
    out[static_cast<Eigen::Index>(first + k)] = white[k];
}

Eigen::VectorXd RigProblem::compare(const RigModel& model, const std::vector<PlantTrace>& plants,
                                    Look look) const {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(rows_));
  std::vector<Prediction> seen(session_.runs.size());
  for (const ResidualBlock& block : blocks_) {
    const SessionRun& run = session_.runs[block.run];
    Prediction& shown = seen[block.run];
    if (shown.cavity_kPa.empty()) shown = observe(model, plants[block.run], run.drive.place, run.sample_s);
    if (block.channel == name_of(Channel::cavity)) {
      add_channel(run, Channel::cavity, shown.cavity_kPa, block.first, look, out);
    } else if (block.channel == name_of(Channel::pump)) {
      add_channel(run, Channel::pump, shown.pump_kPa, block.first, look, out);
    } else {
      auto row = static_cast<Eigen::Index>(block.first);
      for (const GatedVolume& volume : run.volumes) {
        const std::vector<double> mean = gated(volume, plants[block.run]);
        for (size_t f = 0; f < mean.size(); ++f)
          out[row++] = (volume.measured.cavity_mL[f] - mean[f]) / volume.measured.sigma_mL[f];
      }
    }
  }
  if (look == Look::fine) shrink_beats(out);
  return out;
}

void RigProblem::shrink_beats(Eigen::VectorXd& residuals) const {
  for (const Beat& beat : beats_) {
    double along = 0.0;
    Eigen::Index at = 0;
    for (const CycleRows& rows : beat.rows) {
      const auto count = static_cast<Eigen::Index>(rows.last - rows.first);
      along += beat.direction.segment(at, count).dot(
          residuals.segment(static_cast<Eigen::Index>(rows.first), count));
      at += count;
    }
    at = 0;
    for (const CycleRows& rows : beat.rows) {
      const auto count = static_cast<Eigen::Index>(rows.last - rows.first);
      residuals.segment(static_cast<Eigen::Index>(rows.first), count) -=
          beat.taken * along * beat.direction.segment(at, count);
      at += count;
    }
  }
}

std::vector<std::map<Channel, std::vector<double>>> RigProblem::beat_shapes(size_t parity) const {
  constexpr double small = 0.01;
  RigModel plain = model({}, base_.values);
  RigModel varied = plain;
  varied.drive.emplace_back([&](DriveTrace& trace, const RunPlace& place) {
    for (const SessionRun& run : session_.runs)
      if (run.drive.place.name == place.name) vary_cycles(run, parity, small, trace);
  });
  const std::vector<PlantTrace> before = plants(plain);
  const std::vector<PlantTrace> after = plants(varied);
  std::vector<std::map<Channel, std::vector<double>>> shapes;
  for (size_t r = 0; r < session_.runs.size(); ++r) {
    const SessionRun& run = session_.runs[r];
    const Prediction a = observe(plain, before[r], run.drive.place, run.sample_s);
    Prediction b = observe(varied, after[r], run.drive.place, run.sample_s);
    for (size_t k = 0; k < run.sample_s.size(); ++k) {
      b.cavity_kPa[k] = (b.cavity_kPa[k] - a.cavity_kPa[k]) / small;
      b.pump_kPa[k] = (b.pump_kPa[k] - a.pump_kPa[k]) / small;
    }
    shapes.emplace_back();
    for (const auto& [channel, noise] : noise_.channels)
      shapes.back()[channel] = whitened(noise, channel == Channel::cavity ? b.cavity_kPa : b.pump_kPa);
  }
  return shapes;
}

void RigProblem::set_beats() {
  constexpr double ringing = 0.4;  // of a cycle: how far into the next one its line rings on
  const std::array shapes{beat_shapes(0), beat_shapes(1)};
  for (size_t r = 0; r < session_.runs.size(); ++r) {
    const std::vector<CycleRows> cycles = cycles_of(session_.runs[r]);
    const auto lead = static_cast<size_t>(session_.runs[r].drive.motion.spread_s() / 2.0 *
                                          sample_rate_Hz(session_.runs[r]));
    for (size_t c = 0; c < cycles.size(); ++c) {
      const size_t length = cycles[c].last - cycles[c].first;
      const size_t first = cycles[c].first - std::min(cycles[c].first, lead);
      const size_t last =
          std::min(session_.runs[r].sample_s.size(),
                   cycles[c].last + static_cast<size_t>(ringing * static_cast<double>(length)));
      Beat beat;
      std::vector<double> direction;
      for (const ResidualBlock& block : blocks_) {
        if (block.run != r || block.channel == "cavity_mL") continue;
        beat.rows.push_back({block.first + first, block.first + last});
        const auto& shape =
            shapes[c % 2][r].at(block.channel == name_of(Channel::cavity) ? Channel::cavity : Channel::pump);
        direction.insert(direction.end(), shape.begin() + static_cast<std::ptrdiff_t>(first),
                         shape.begin() + static_cast<std::ptrdiff_t>(last));
      }
      beat.direction =
          Eigen::Map<const Eigen::VectorXd>(direction.data(), static_cast<Eigen::Index>(direction.size()));
      const double size = beat.direction.norm();
      if (size == 0.0) continue;
      beat.direction /= size;
      const double strength = noise_.beat_sd * size;
      beat.taken = 1.0 - 1.0 / std::sqrt(1.0 + strength * strength);
      beats_.push_back(std::move(beat));
    }
  }
}

std::vector<Prediction> RigProblem::predictions(const std::vector<Ingredient>& ingredients,
                                                const std::vector<double>& values) const {
  const RigModel made = model(ingredients, values);
  const std::vector<PlantTrace> traces = plants(made);
  std::vector<Prediction> seen;
  for (size_t r = 0; r < traces.size(); ++r)
    seen.push_back(observe(made, traces[r], session_.runs[r].drive.place, session_.runs[r].sample_s));
  return seen;
}

Eigen::VectorXd RigProblem::residuals(const std::vector<Ingredient>& ingredients,
                                      const std::vector<double>& values, Look look) const {
  const RigModel made = model(ingredients, values);
  return compare(made, plants(made), look);
}

RigFit RigProblem::fit(const std::vector<Ingredient>& ingredients) const {
  constexpr size_t tried = 2;
  constexpr double far_off = 4.0;  // coarse squares a row, when even the best start is not near
  std::vector<std::pair<double, std::vector<double>>> starts;
  const auto add_start = [&](double size) {
    std::vector<double> values = base_.values;
    for (const Ingredient& ingredient : ingredients) {
      const std::vector<double> neutral = ingredient.effect->neutral(session_.base);
      for (size_t j = 0; j < neutral.size(); ++j) {
        const EffectParameter& parameter = ingredient.effect->parameters()[j];
        const double from = to_search(parameter.scale, neutral[j]);
        const double towards = to_search(parameter.scale, parameter.typical);
        const double sought =
            j == 0 ? from_search(parameter.scale, from + size * (towards - from)) : parameter.typical;
        if (!(sought >= parameter.lower && sought <= parameter.upper)) return;
        values.push_back(sought);
      }
    }
    starts.emplace_back(residuals(ingredients, values, Look::coarse).squaredNorm(), values);
  };
  for (const double size : {0.1, 0.3, 0.6, 1.0, 1.5, 2.5, 4.0, -0.3, -1.0})
    add_start(size);
  if (starts.empty() ||
      std::min_element(starts.begin(), starts.end())->first > far_off * static_cast<double>(rows_)) {
    for (const double size :
         {0.14, 0.2, 0.25, 0.36, 0.43, 0.51, 0.7, 0.8, 0.9, 1.12, 1.25, 1.37, 1.75, 2.1, 3.0, 3.5})
      add_start(size);
  }
  size_t simulations = starts.size();
  std::sort(starts.begin(), starts.end());
  starts.resize(std::min(starts.size(), tried));
  RigFit rough;
  for (const auto& [square, values] : starts) {
    RigFit from_here = fit_from(ingredients, values, Look::coarse);
    simulations += from_here.simulations;
    if (rough.values.empty() || from_here.chi_square < rough.chi_square) rough = std::move(from_here);
  }
  RigFit fine = fit_from(ingredients, rough.values, Look::fine);
  fine.iterations += rough.iterations;
  fine.simulations += simulations;
  return fine;
}

RigFit RigProblem::fit_from(const std::vector<Ingredient>& ingredients, std::vector<double> values,
                            Look look) const {
  RigFit fit;
  fit.ingredients = ingredients;
  fit.unknowns = unknowns(ingredients);
  fit.count = rows_ - missing_;
  const auto coordinates = search_coordinates(ingredients, fit.unknowns);
  const auto count = static_cast<Eigen::Index>(values.size());
  const auto natural = [&](const Eigen::VectorXd& sought) {
    std::vector<double> out;
    for (Eigen::Index i = 0; i < count; ++i)
      out.push_back(from_search(coordinates[static_cast<size_t>(i)].scale, sought[i]));
    return out;
  };
  Eigen::VectorXd at(count);
  for (Eigen::Index i = 0; i < count; ++i)
    at[i] = std::clamp(to_search(coordinates[static_cast<size_t>(i)].scale, values[static_cast<size_t>(i)]),
                       coordinates[static_cast<size_t>(i)].lower, coordinates[static_cast<size_t>(i)].upper);

  double damping = 1e-6;
  RigModel made = model(ingredients, natural(at));
  std::vector<PlantTrace> traces = plants(made);
  fit.residuals = compare(made, traces, look);
  fit.simulations = 1;
  Eigen::MatrixXd normal;
  std::vector<bool> held(static_cast<size_t>(count), false);
  const bool pump = noise_.channels.contains(Channel::pump);
  for (; fit.iterations < options_.most_iterations && !fit.converged; ++fit.iterations) {
    fit.jacobian.resize(fit.residuals.size(), count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const SearchCoordinate& coordinate = coordinates[static_cast<size_t>(i)];
      Eigen::VectorXd moved = at;
      const double step = at[i] + coordinate.nudge > coordinate.upper ? -coordinate.nudge : coordinate.nudge;
      moved[i] += step;
      const RigModel other = model(ingredients, natural(moved));
      if (!coordinate.sensors_only) ++fit.simulations;
      fit.jacobian.col(i) =
          (compare(other, coordinate.sensors_only ? traces : plants(other), look) - fit.residuals) / step;
    }
    normal = fit.jacobian.transpose() * fit.jacobian;
    const Eigen::VectorXd gradient = fit.jacobian.transpose() * fit.residuals;
    for (Eigen::Index i = 0; i < count; ++i) {
      const SearchCoordinate& coordinate = coordinates[static_cast<size_t>(i)];
      held[static_cast<size_t>(i)] = (at[i] <= coordinate.lower && gradient[i] > 0.0) ||
                                     (at[i] >= coordinate.upper && gradient[i] < 0.0) || (i == 2 && !pump) ||
                                     normal(i, i) <= 0.0;
    }
    const double before = fit.residuals.squaredNorm();
    bool better = false;
    for (int tries = 0; tries < 10 && !better; ++tries) {
      Eigen::MatrixXd system = normal;
      Eigen::VectorXd right = -gradient;
      for (Eigen::Index i = 0; i < count; ++i) {
        system(i, i) *= 1.0 + damping;
        if (!held[static_cast<size_t>(i)]) continue;
        system.row(i).setZero();
        system.col(i).setZero();
        system(i, i) = 1.0;
        right[i] = 0.0;
      }
      const Eigen::VectorXd step = system.ldlt().solve(right);
      Eigen::VectorXd next = at + step;
      for (Eigen::Index i = 0; i < count; ++i)
        next[i] = std::clamp(next[i], coordinates[static_cast<size_t>(i)].lower,
                             coordinates[static_cast<size_t>(i)].upper);
      const RigModel tried = model(ingredients, natural(next));
      std::vector<PlantTrace> tried_traces = plants(tried);
      const Eigen::VectorXd tried_residuals = compare(tried, tried_traces, look);
      ++fit.simulations;
      const double after = tried_residuals.squaredNorm();
      if (std::isfinite(after) && after <= before) {
        better = true;
        fit.converged = before - after < 0.02 + 1e-7 * before;
        at = next;
        traces = std::move(tried_traces);
        fit.residuals = tried_residuals;
        damping = std::max(damping * 0.1, 1e-9);
      } else {
        damping = std::max(damping * 30.0, 1e-4);
      }
    }
    if (!better) fit.converged = true;
  }
  fit.values = natural(at);
  fit.chi_square = fit.residuals.squaredNorm();
  for (Eigen::Index i = 0; i < count; ++i) {
    if (!held[static_cast<size_t>(i)]) continue;
    normal.row(i).setZero();
    normal.col(i).setZero();
    normal(i, i) = 1.0;
  }
  const Eigen::MatrixXd covariance = normal.inverse();
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto k = static_cast<size_t>(i);
    const double slope = natural_slope(coordinates[k].scale, at[i]);
    fit.errors.push_back(held[k] ? 0.0 : std::abs(slope) * std::sqrt(std::max(covariance(i, i), 0.0)));
  }
  return fit;
}

}  // namespace diastole::rig
