#include "estimator/explain/rig/experiment_outlook.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/inference/information.hpp"
#include "estimator/rig/sampled_signal.hpp"

namespace diastole::explain {
namespace {

using rig::Channel;

constexpr double zero_sd_Pa = 30.0;
constexpr size_t frames = 32;               // of a gated volume
constexpr double usual_volume_sd_mL = 0.6;  // if the session has none
constexpr Eigen::Index zeros = 2;           // unknowns of a new run: its sensors' zeros

struct Noise {
  rig::ChannelNoise cavity, pump;
  double volume_sd_mL, cycle_sd;
};

Noise noise_of(const rig::SessionProblem& problem) {
  const rig::Session& session = problem.session();
  const auto& channels = problem.noise().channels;
  Noise noise{channels.at(Channel::cavity), channels.at(Channel::cavity), usual_volume_sd_mL,
              std::max(problem.noise().cycle_sd, 1e-4)};
  if (channels.contains(Channel::pump)) {
    noise.pump = channels.at(Channel::pump);
  } else {
    // A range five times as wide for the same converter, and a motor beside it.
    const double larger = 2.0 + 0.03 / noise.cavity.sd_kPa;
    noise.pump.sd_kPa *= larger;
    noise.pump.innovation_kPa *= larger;
  }
  for (const rig::SessionRun& run : session.runs) {
    for (const rig::GatedVolume& volume : run.volumes)
      if (!volume.measured.sigma_mL.empty()) noise.volume_sd_mL = volume.measured.sigma_mL.front();
  }
  return noise;
}

/// What all three channels show of a model, one after the other.
struct Seen {
  std::array<Eigen::VectorXd, measured_count> y;
};

Seen seen_of(const rig::RigModel& model, const rig::PlantTrace& plant, const TrialRun& trial) {
  const rig::Prediction shown = rig::observe(model, plant, trial.drive.place, trial.sample_s);
  Seen seen;
  const auto count = static_cast<Eigen::Index>(trial.sample_s.size());
  seen.y[0] = Eigen::Map<const Eigen::VectorXd>(shown.cavity_kPa.data(), count);
  seen.y[1] = Eigen::Map<const Eigen::VectorXd>(shown.pump_kPa.data(), count);
  if (trial.last_end > trial.last_first) {
    seen.y[2].resize(static_cast<Eigen::Index>(frames));
    const double step_s = 1.0 / 300.0;
    for (size_t f = 0; f < frames; ++f) {
      const double part = (static_cast<double>(f) + 0.5) / static_cast<double>(frames);
      const double time_s = step_s * std::lerp(static_cast<double>(trial.last_first),
                                               static_cast<double>(trial.last_end), part);
      seen.y[2][static_cast<Eigen::Index>(f)] =
          rig::sampled(plant.cavity_mL, (time_s - plant.start_s) / plant.step_s);
    }
  }
  return seen;
}

/// Whitened and weighted rows of one channel.
Eigen::VectorXd rows_of(const Noise& noise, const TrialRun& trial, size_t channel, const Eigen::VectorXd& y) {
  if (channel == static_cast<size_t>(Observable::volume)) return y / noise.volume_sd_mL;
  const std::vector<double> values(y.data(), y.data() + y.size());
  const std::vector<double> white = rig::whitened(channel == 0 ? noise.cavity : noise.pump, values);
  Eigen::VectorXd rows = Eigen::Map<const Eigen::VectorXd>(white.data(), y.size());
  for (size_t k = trial.last_first; k < std::min(trial.last_end, white.size()); ++k)
    rows[static_cast<Eigen::Index>(k)] *= std::sqrt(trial.repeats);
  return rows;
}

/// A model's rows and its derivatives' by channel; the last two columns are the run's zeros.
struct Rows {
  std::array<Eigen::VectorXd, measured_count> shown;  ///< kPa, mL
  std::array<Eigen::VectorXd, measured_count> y;
  std::array<Eigen::MatrixXd, measured_count> K;
};

Rows rows_of(const rig::SessionProblem& problem, const FittedModel& fit, const TrialRun& trial,
             const Noise& noise) {
  const rig::RigModel made = problem.model(fit.model);
  const rig::PlantTrace plant = rig::simulate_plant(made, trial.drive);
  const Seen base = seen_of(made, plant, trial);
  const Eigen::Index count = fit.coordinates.size();
  Rows rows;
  for (size_t c = 0; c < measured_count; ++c) {
    rows.shown[c] = base.y[c];
    rows.y[c] = rows_of(noise, trial, c, base.y[c]);
    rows.K[c].resize(base.y[c].size(), count + zeros);
    rows.K[c].rightCols(zeros).setZero();
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    double step = 0.0;
    const rig::RigModel moved = problem.model(fit.moved(i, step));
    const bool same_plant = fit.unknowns[static_cast<size_t>(i)].sensors_only;
    const Seen other = seen_of(moved, same_plant ? plant : rig::simulate_plant(moved, trial.drive), trial);
    for (size_t c = 0; c < measured_count; ++c)
      rows.K[c].col(i) = rows_of(noise, trial, c, (other.y[c] - base.y[c]) / step);
  }
  for (size_t c = 0; c < 2; ++c) {
    rows.K[c].col(count + static_cast<Eigen::Index>(c)) =
        rows_of(noise, trial, c, Eigen::VectorXd::Constant(base.y[c].size(), 1e-3 * zero_sd_Pa));
  }
  return rows;
}

/// What the model's own error may add in the last cycle, sds of its harmonics as columns.
Eigen::MatrixXd error_rows(const rig::SessionProblem& problem, const TrialRun& trial, const Noise& noise,
                           size_t channel, const Eigen::VectorXd& shown) {
  constexpr int harmonics = 8;
  const rig::SharePrior& prior = problem.error().prior;
  const double share = prior.share[static_cast<size_t>(channel == 0   ? rig::ErrorGroup::cavity
                                                       : channel == 1 ? rig::ErrorGroup::pump
                                                                      : rig::ErrorGroup::volume)];
  const bool volume = channel == static_cast<size_t>(Observable::volume);
  const auto first = volume ? Eigen::Index{0} : static_cast<Eigen::Index>(trial.last_first);
  const auto last = volume ? shown.size() : static_cast<Eigen::Index>(trial.last_end);
  if (last <= first) return Eigen::MatrixXd::Zero(shown.size(), 0);
  const auto cycle = shown.segment(first, last - first);
  const double size = share * (cycle.maxCoeff() - cycle.minCoeff());
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(shown.size(), 2 * harmonics + 1);
  for (Eigen::Index k = 0; k < last - first; ++k) {
    const double turn = 2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(last - first);
    for (int h = 0; h <= harmonics; ++h) {
      const double amplitude = size / std::pow(1.0 + h, 1.5);
      columns(first + k, h) = amplitude * std::cos(h * turn);
      if (h > 0) columns(first + k, harmonics + h) = amplitude * std::sin(h * turn);
    }
  }
  for (Eigen::Index i = 0; i < columns.cols(); ++i)
    columns.col(i) = rows_of(noise, trial, channel, columns.col(i));
  return columns;
}

}  // namespace

Eigen::MatrixXd SegmentOutlook::of(size_t truth, size_t adapting, const Equipment& equipment) const {
  const auto& channels = gram[truth][adapting];
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(channels[0].rows(), channels[0].cols());
  for (size_t c = 0; c < measured_count; ++c)
    if (equipment[c]) sum += channels[c];
  return sum;
}

rig::SessionModel FittedModel::moved(Eigen::Index unknown, double& step) const {
  const rig::Unknown& at = unknowns[static_cast<size_t>(unknown)];
  step = at.step_from(coordinates[unknown]);
  rig::SessionModel other = model;
  const auto effects = static_cast<Eigen::Index>(model.values.size());
  if (unknown < effects) {
    other.values[static_cast<size_t>(unknown)] = at.value(coordinates[unknown] + step);
  } else {
    other.nuisances[unknown - effects] += step;
  }
  return other;
}

FittedModel fitted_model(const rig::SessionProblem& problem, const EffectSet& set) {
  FittedModel fit{.model = set.model,
                  .unknowns = set.unknowns,
                  .coordinates = {},
                  .covariance = {},
                  .errors = set.errors};
  const auto effects = static_cast<Eigen::Index>(set.model.values.size());
  const auto count = effects + static_cast<Eigen::Index>(rig::basic_nuisances);
  const Eigen::Index first_nuisance = set.covariance.rows() - set.model.nuisances.size();
  fit.coordinates.resize(count);
  fit.covariance.resize(count, count);
  const auto place = [&](Eigen::Index i) { return i < effects ? i : first_nuisance + i - effects; };
  for (Eigen::Index i = 0; i < count; ++i) {
    if (i < effects) {
      const auto k = static_cast<size_t>(i);
      fit.coordinates[i] = fit.unknowns[k].coordinate(set.model.values[k]);
    } else {
      fit.coordinates[i] = set.model.nuisances[i - effects];
      const rig::Nuisance& nuisance = problem.nuisances()[static_cast<size_t>(i - effects)];
      fit.unknowns.push_back({{.name = nuisance.name}, 0.01, nuisance.sensors_only});
    }
    for (Eigen::Index j = 0; j < count; ++j)
      fit.covariance(i, j) = set.covariance(place(i), place(j));
  }
  return fit;
}

Eigen::MatrixXd known_before(const FittedModel& fit) {
  const Eigen::Index count = fit.coordinates.size();
  Eigen::MatrixXd known = Eigen::MatrixXd::Identity(count + zeros, count + zeros);
  known.topLeftCorner(count, count) = inference::information_of_covariance(fit.covariance);
  return known;
}

Equipment equipment_of(const rig::Session& session) {
  Equipment equipment{true};
  for (const rig::SessionRun& run : session.runs) {
    equipment[1] = equipment[1] || run.pressure_kPa.contains(Channel::pump);
    equipment[2] = equipment[2] || !run.volumes.empty();
  }
  return equipment;
}

SegmentOutlook look_ahead(const rig::SessionProblem& problem, const std::vector<const FittedModel*>& models,
                          const runfile::Segment& segment) {
  const TrialRun trial = trial_of(segment, problem.session());
  const Noise noise = noise_of(problem);
  std::vector<Rows> rows;
  for (const FittedModel* fit : models)
    rows.push_back(rows_of(problem, *fit, trial, noise));
  SegmentOutlook outlook;
  outlook.gram.resize(models.size());
  for (size_t a = 0; a < models.size(); ++a) {
    outlook.gram[a].resize(models.size());
    for (size_t b = 0; b < models.size(); ++b) {
      for (size_t c = 0; c < measured_count; ++c) {
        Eigen::MatrixXd all(rows[b].K[c].rows(), rows[b].K[c].cols() + 1);
        all << rows[a].y[c] - rows[b].y[c], rows[b].K[c];
        if (c != static_cast<size_t>(Observable::volume) && all.rows() > 0) {
          // The mean of the cycles' random sizes, known to cycle_sd over the root of their number.
          const Eigen::VectorXd& shape = rows[a].y[c];
          const double loose = (trial.repeats + 2.0) / (noise.cycle_sd * noise.cycle_sd);
          all -= shape * ((shape.transpose() * all) / (shape.squaredNorm() + loose));
        }
        Eigen::MatrixXd& gram = outlook.gram[a][b][c];
        gram = all.transpose() * all;
        if (all.rows() == 0) continue;
        const Eigen::MatrixXd error = error_rows(problem, trial, noise, c, rows[a].shown[c]);
        if (error.cols() == 0) continue;
        const Eigen::MatrixXd mixed = error.transpose() * all;
        Eigen::MatrixXd own = error.transpose() * error;
        own.diagonal().array() += 1.0;
        gram -= mixed.transpose() * own.llt().solve(mixed);
      }
    }
  }
  return outlook;
}

Eigen::MatrixXd gram_beside(const rig::SessionProblem& problem, const FittedModel& truth,
                            const FittedModel& adapting, const Equipment& equipment,
                            const SpecimenKnowledge& knowledge) {
  const Eigen::Index count = adapting.coordinates.size();
  const auto modulus = static_cast<Eigen::Index>(adapting.model.values.size());
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(count + zeros + 1, count + zeros + 1);
  if (equipment[static_cast<size_t>(Observable::radius)] && knowledge.inner_radius_mm > 0.0) {
    const auto larger = [](const FittedModel& fit, Eigen::Index* unknown) {
      size_t at = 0;
      for (const rig::ModelTerm& term : fit.model.terms)
        for (const EffectParameter& parameter : term.effect->parameters()) {
          if (parameter.seen_at_rest) {
            if (unknown != nullptr) *unknown = static_cast<Eigen::Index>(at);
            return fit.model.values[at];
          }
          ++at;
        }
      return 0.0;
    };
    const double error = knowledge.radius_error_mm / knowledge.inner_radius_mm;
    Eigen::Index own = -1;
    Eigen::VectorXd row = Eigen::VectorXd::Zero(sum.cols());
    row[0] = (larger(truth, nullptr) - larger(adapting, &own)) / error;
    if (own >= 0)
      row[1 + own] = adapting.unknowns[static_cast<size_t>(own)].slope(adapting.coordinates[own]) / error;
    sum += row * row.transpose();
  }
  const auto is_lasting = [](const FittedModel& fit) {
    return std::ranges::all_of(fit.model.terms,
                               [](const rig::ModelTerm& term) { return term.effect->keeps_modulus(); });
  };
  if (equipment[static_cast<size_t>(Observable::stiffness)] && is_lasting(truth) && is_lasting(adapting)) {
    const double sd = problem.nuisances()[0].sd;
    Eigen::VectorXd row = Eigen::VectorXd::Zero(sum.cols());
    row[0] = sd * (truth.model.nuisances[0] - adapting.model.nuisances[0]) / knowledge.relative_C1_error;
    row[1 + modulus] = sd / knowledge.relative_C1_error;
    sum += row * row.transpose();
  }
  return sum;
}

}  // namespace diastole::explain
