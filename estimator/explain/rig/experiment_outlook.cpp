#include "estimator/explain/rig/experiment_outlook.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

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

Noise noise_of(const rig::Session& session, const rig::RigProblem& problem) {
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
  if (channel == static_cast<size_t>(Measured::volume)) return y / noise.volume_sd_mL;
  const std::vector<double> values(y.data(), y.data() + y.size());
  const std::vector<double> white = rig::whitened(channel == 0 ? noise.cavity : noise.pump, values);
  Eigen::VectorXd rows = Eigen::Map<const Eigen::VectorXd>(white.data(), y.size());
  for (size_t k = trial.last_first; k < std::min(trial.last_end, white.size()); ++k)
    rows[static_cast<Eigen::Index>(k)] *= std::sqrt(trial.repeats);
  return rows;
}

/// A model's rows and its derivatives' by channel; the last two columns are the run's zeros.
struct Rows {
  std::array<Eigen::VectorXd, measured_count> y;
  std::array<Eigen::MatrixXd, measured_count> K;
};

Rows rows_of(const rig::RigProblem& problem, const rig::RigFit& fit, const TrialRun& trial,
             const Noise& noise) {
  const rig::RigModel made = problem.model(fit);
  const rig::PlantTrace plant = rig::simulate_plant(made, trial.drive);
  const Seen base = seen_of(made, plant, trial);
  const auto count = static_cast<Eigen::Index>(fit.values.size());
  Rows rows;
  for (size_t c = 0; c < measured_count; ++c) {
    rows.y[c] = rows_of(noise, trial, c, base.y[c]);
    rows.K[c].resize(base.y[c].size(), count + zeros);
    rows.K[c].rightCols(zeros).setZero();
  }
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto k = static_cast<size_t>(i);
    const rig::Unknown& unknown = fit.unknowns[k];
    const double at = unknown.coordinate(fit.values[k]);
    const double step = unknown.step_from(at);
    rig::KnownModel other_values = fit;
    other_values.values[k] = unknown.value(at + step);
    const rig::RigModel moved = problem.model(other_values);
    const Seen other =
        seen_of(moved, unknown.sensors_only ? plant : rig::simulate_plant(moved, trial.drive), trial);
    for (size_t c = 0; c < measured_count; ++c)
      rows.K[c].col(i) = rows_of(noise, trial, c, (other.y[c] - base.y[c]) / step);
  }
  for (size_t c = 0; c < 2; ++c) {
    rows.K[c].col(count + static_cast<Eigen::Index>(c)) =
        rows_of(noise, trial, c, Eigen::VectorXd::Constant(base.y[c].size(), 1e-3 * zero_sd_Pa));
  }
  return rows;
}

}  // namespace

Eigen::MatrixXd SegmentOutlook::of(size_t truth, size_t adapting, const Equipment& equipment) const {
  const auto& channels = gram[truth][adapting];
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(channels[0].rows(), channels[0].cols());
  for (size_t c = 0; c < measured_count; ++c)
    if (equipment[c]) sum += channels[c];
  return sum;
}

Eigen::MatrixXd known_before(const rig::RigProblem& problem, const rig::RigFit& fit) {
  constexpr double ridge = 1e-6;  // far weaker than any data
  const auto count = static_cast<Eigen::Index>(fit.values.size());
  const Eigen::MatrixXd columns =
      fit.jacobian.cols() == count && fit.jacobian.rows() > 0 ? fit.jacobian : problem.columns(fit);
  Eigen::MatrixXd known = Eigen::MatrixXd::Identity(count + zeros, count + zeros);
  known.topLeftCorner(count, count) = columns.transpose() * columns;
  known.topLeftCorner(count, count).diagonal().array() += ridge;
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

SegmentOutlook look_ahead(const rig::Session& session, const rig::RigProblem& problem,
                          const std::vector<const rig::RigFit*>& models, const runfile::Segment& segment) {
  const TrialRun trial = trial_of(segment, session);
  const Noise noise = noise_of(session, problem);
  std::vector<Rows> rows;
  for (const rig::RigFit* fit : models)
    rows.push_back(rows_of(problem, *fit, trial, noise));
  SegmentOutlook outlook;
  outlook.gram.resize(models.size());
  for (size_t a = 0; a < models.size(); ++a) {
    outlook.gram[a].resize(models.size());
    for (size_t b = 0; b < models.size(); ++b) {
      for (size_t c = 0; c < measured_count; ++c) {
        Eigen::MatrixXd all(rows[b].K[c].rows(), rows[b].K[c].cols() + 1);
        all << rows[a].y[c] - rows[b].y[c], rows[b].K[c];
        if (c != static_cast<size_t>(Measured::volume) && all.rows() > 0) {
          // The mean of the cycles' random sizes, known to cycle_sd over the root of their number.
          const Eigen::VectorXd& shape = rows[a].y[c];
          const double loose = (trial.repeats + 2.0) / (noise.cycle_sd * noise.cycle_sd);
          all -= shape * ((shape.transpose() * all) / (shape.squaredNorm() + loose));
        }
        outlook.gram[a][b][c] = all.transpose() * all;
      }
    }
  }
  return outlook;
}

Eigen::MatrixXd gram_beside(const rig::RigFit& truth, const rig::RigFit& adapting, const Equipment& equipment,
                            const SpecimenKnowledge& knowledge) {
  const auto count = static_cast<Eigen::Index>(adapting.values.size());
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(count + zeros + 1, count + zeros + 1);
  const auto add = [&](std::string_view unknown, double difference, double error) {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(sum.cols());
    row[0] = difference / error;
    for (Eigen::Index i = 0; i < count; ++i) {
      const auto k = static_cast<size_t>(i);
      const rig::Unknown& own = adapting.unknowns[k];
      if (own.name == unknown) row[1 + i] = own.slope(own.coordinate(adapting.values[k])) / error;
    }
    sum += row * row.transpose();
  };
  if (equipment[static_cast<size_t>(Measured::radius)] && knowledge.inner_radius_mm > 0.0) {
    const auto value = [](const rig::RigFit& fit, const std::string& unknown) {
      const double part = fit.value(unknown);
      return std::isfinite(part) ? part : 0.0;
    };
    for (const Effect* effect : rig_effects()) {
      for (const EffectParameter& parameter : effect->parameters()) {
        if (!parameter.seen_at_rest) continue;
        const std::string unknown = fmt::format("{}.{}", effect->text().id, parameter.name);
        add(unknown, value(truth, unknown) - value(adapting, unknown),
            knowledge.radius_error_mm / knowledge.inner_radius_mm);
      }
    }
  }
  const auto is_lasting = [](const rig::RigFit& fit) {
    return std::ranges::all_of(fit.terms,
                               [](const rig::ModelTerm& term) { return term.effect->keeps_modulus(); });
  };
  if (equipment[static_cast<size_t>(Measured::stiffness)] && is_lasting(truth) && is_lasting(adapting))
    add("modulus_kPa", truth.values[0] - adapting.values[0], knowledge.relative_C1_error * truth.values[0]);
  return sum;
}

double separation(const Eigen::MatrixXd& gram, const Eigen::MatrixXd& known) {
  const Eigen::Index count = gram.rows() - 1;
  const Eigen::VectorXd g = gram.block(1, 0, count, 1);
  const Eigen::MatrixXd normal = gram.block(1, 1, count, count) + known;
  return std::sqrt(std::max(0.0, gram(0, 0) - g.dot(normal.ldlt().solve(g))));
}

}  // namespace diastole::explain
