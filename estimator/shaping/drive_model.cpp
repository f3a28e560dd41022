#include "estimator/shaping/drive_model.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>

#include "estimator/effects/effect.hpp"
#include "estimator/parallel/parallel_for.hpp"
#include "estimator/rig/sampled_signal.hpp"

namespace diastole::shaping {
namespace {

using Complex = std::complex<double>;

constexpr double ramp_s = 1.0;  ///< the controller's least (docs/firmware.md, A run)

/// Rest, a ramp to the cycle's least volume, the cycles.
struct PlayedDrive {
  PeriodicCurve drive_mL;
  double begins_s = 0.0;  ///< of the curve, a cycle
  double least_mL = 0.0;
  double rest_s = 0.0;
  double first_s = 0.0;  ///< of the run, the first cycle
  double end_s = 0.0;    ///< the last one ends
  double home_s = 0.0;

  [[nodiscard]] rig::Motion::State at(double time_s) const {
    if (time_s >= home_s) return {};
    if (time_s >= end_s) return ramp(home_s - time_s, -1.0);
    if (time_s >= first_s) {
      const double on_curve_s = begins_s + time_s - first_s;
      return {drive_mL.at(on_curve_s), drive_mL.at(on_curve_s, 1), drive_mL.at(on_curve_s, 2)};
    }
    if (time_s <= rest_s) return {};
    return ramp(time_s - rest_s, 1.0);
  }
  /// From home, or backwards.
  [[nodiscard]] rig::Motion::State ramp(double since_s, double direction) const {
    const double rate = std::numbers::pi / ramp_s, turn = rate * since_s;
    return {0.5 * least_mL * (1.0 - std::cos(turn)), direction * 0.5 * least_mL * rate * std::sin(turn),
            0.5 * least_mL * rate * rate * std::cos(turn)};
  }
};

PlayedDrive played(const PeriodicCurve& drive_mL, const CyclePlan& plan) {
  PlayedDrive drive{.drive_mL = drive_mL, .begins_s = drive_mL.least_at_s()};
  drive.least_mL = drive_mL.at(drive.begins_s);
  drive.rest_s = plan.rest_s;
  drive.first_s = plan.rest_s + ramp_s;
  drive.end_s = drive.first_s + drive_mL.period_s * static_cast<double>(plan.cycles);
  drive.home_s = drive.end_s + ramp_s;
  return drive;
}

/// Mean over the cycles that count, at even times of the curve.
PeriodicCurve mean_cycle(const std::vector<double>& values, const rig::PlantTrace& trace,
                         const PlayedDrive& drive, const CyclePlan& plan, Eigen::Index harmonics) {
  const double period_s = drive.drive_mL.period_s;
  std::vector<double> mean(static_cast<size_t>(4 * harmonics + 4));
  const auto counted = static_cast<double>(plan.cycles - plan.settling);
  for (size_t j = 0; j < mean.size(); ++j) {
    const double time_s = period_s * static_cast<double>(j) / static_cast<double>(mean.size());
    const double since_s = std::fmod(time_s - drive.begins_s + period_s, period_s);
    for (size_t cycle = plan.settling; cycle < plan.cycles; ++cycle) {
      const double at_s = drive.first_s + since_s + period_s * static_cast<double>(cycle);
      mean[j] += rig::sampled(values, (at_s - trace.start_s) / trace.step_s) / counted;
    }
  }
  return periodic_curve(mean, period_s, harmonics);
}

}  // namespace

DriveModel::DriveModel(rig::RigModel base, std::shared_ptr<const rig::SpecimenCurves> curves,
                       EffectLibrary library, std::vector<LearnableEffect> effects, rig::RunPlace place,
                       const CyclePlan& plan)
    : base_(std::move(base)),
      curves_(std::move(curves)),
      library_(std::move(library)),
      effects_(std::move(effects)),
      model_(base_),
      place_(std::move(place)),
      plan_(plan) {
  for (const LearnableEffect& one : effects_)
    one.effect->apply(one.values, {*curves_}, model_);
}

DriveModel DriveModel::with_values(std::span<const double> values) const {
  std::vector<LearnableEffect> effects = effects_;
  for (LearnableEffect& one : effects) {
    one.values.assign(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(one.values.size()));
    values = values.subspan(one.values.size());
  }
  return {base_, curves_, library_, std::move(effects), place_, plan_};
}

ModelResponse DriveModel::response(const PeriodicCurve& drive_mL, Eigen::Index harmonics) const {
  constexpr double about_step_s = 1.0 / 150.0, settled_s = 3.0;
  const PlayedDrive drive = played(drive_mL, plan_);
  rig::RunDrive run{.motion = {}, .place = place_};
  run.place.trigger_s.clear();
  for (size_t cycle = 0; cycle < plan_.cycles; ++cycle)
    run.place.trigger_s.push_back(drive.first_s + drive_mL.period_s * static_cast<double>(cycle));
  run.repetitions.push_back({drive.first_s, drive_mL.period_s, plan_.cycles});
  run.end_s = drive.home_s + settled_s;
  run.waveform = [&drive](double time_s) { return drive.at(time_s); };
  const rig::PlantTrace trace =
      rig::simulate_plant(model_, run, {.step_s = rig::dividing_step(run, about_step_s), .components = 3});
  ModelResponse shown{.cavity_mL = mean_cycle(trace.cavity_mL, trace, drive, plan_, harmonics),
                      .greatest_kPa = std::ranges::max(trace.cavity_kPa)};
  const auto ringing =
      static_cast<std::ptrdiff_t>(0.5 * settled_s / trace.step_s);  // mean over the rest's second half
  shown.left_mL = std::accumulate(trace.cavity_mL.end() - ringing, trace.cavity_mL.end(), 0.0) /
                  static_cast<double>(ringing);
  return shown;
}

Eigen::MatrixXd DriveModel::jacobian(const PeriodicCurve& drive_mL) const {
  constexpr double part =
      0.005;  // of the range: small beside what bends the specimen's curve, large beside a play's corners
  const double size_mL = part * drive_mL.range();
  const Eigen::VectorXd at = numbers_of(drive_mL);
  const Eigen::VectorXd here = numbers_of(response(drive_mL, drive_mL.harmonics()).cavity_mL);
  Eigen::MatrixXd columns(at.size(), at.size());
  parallel_for(static_cast<size_t>(at.size()), machine_threads(), [&](size_t index) {
    const auto i = static_cast<Eigen::Index>(index);
    Eigen::VectorXd moved = at;
    moved[i] += size_mL;
    const PeriodicCurve volume = response(curve_of(moved, drive_mL.period_s), drive_mL.harmonics()).cavity_mL;
    columns.col(i) = (numbers_of(volume) - here) / size_mL;
  });
  return columns;
}

PeriodicCurve DriveModel::inverse(const PeriodicCurve& cavity_mL, const PeriodicCurve& start) const {
  constexpr int most_rounds = 16, most_linearisations = 4;
  constexpr double close = 2e-4, quick = 0.5;  // of the range; of the error before
  const double period_s = cavity_mL.period_s;
  const Eigen::Index harmonics = start.harmonics();
  const Eigen::VectorXd wanted = numbers_of(cavity_mL.with(harmonics));
  Eigen::VectorXd best = numbers_of(start), drive = best, step = Eigen::VectorXd::Zero(wanted.size());
  double least = std::numeric_limits<double>::infinity(), share = 1.0;
  Eigen::PartialPivLU<Eigen::MatrixXd> slope(jacobian(curve_of(drive, period_s)));
  int linearisations = 1;
  for (int round = 0; round < most_rounds; ++round) {
    const Eigen::VectorXd error =
        wanted - numbers_of(response(curve_of(drive, period_s), harmonics).cavity_mL);
    const double before = least;
    if (error.norm() < least) {
      least = error.norm();
      best = drive;
      step = slope.solve(error);
      share = 1.0;
    } else {
      share *= 0.5;
    }
    if (least < close * cavity_mL.range()) break;
    if (least > quick * before && linearisations < most_linearisations) {
      slope.compute(jacobian(curve_of(best, period_s)));
      ++linearisations;
      step = slope.solve(wanted - numbers_of(response(curve_of(best, period_s), harmonics).cavity_mL));
      share = 1.0;
    }
    drive = best + share * step;
  }
  return curve_of(best, period_s);
}

std::vector<LearnableEffect> learnable_effects(const EffectLibrary& library, const rig::RigModel& base) {
  std::vector<LearnableEffect> list;
  for (const Effect* effect : library.of_rig()) {
    const EffectDeclaration& text = effect->text();
    if (effect->stage() == Stage::plant && effect->change_points() == ChangePoints::none &&
        effect->keeps_modulus() && !text.needs_neighbours)
      list.push_back({effect, effect->neutral(base)});
  }
  return list;
}

rig::SpecimenReach specimen_reach(const Study& study, double volume_mL, double pressure_kPa) {
  const rig::SpecimenResolution usual;
  const double solved_mL = usual.spacing_mL * static_cast<double>(usual.points_inflated);
  if (volume_mL <= solved_mL) return {.volume_mL = solved_mL};
  return rig::SpecimenFamily(study).reach(volume_mL, pressure_kPa);
}

DriveModel drive_model_of(const Study& study, double largest_mL, const CyclePlan& plan) {
  const rig::Session session = rig::read_session(study);
  const auto family =
      std::make_shared<rig::SpecimenFamily>(study, rig::SpecimenResolution{}.reaching(largest_mL));
  rig::RigModel base = session.base;
  base.curve = family->plain();
  base.modulus_kPa = family->modulus_start_kPa();
  std::vector<LearnableEffect> effects = learnable_effects(session.effects, base);
  for (const rig::StatedEffect& stated : rig::stated_effects(study, session)) {
    const auto learnable = std::ranges::find(effects, stated.effect, &LearnableEffect::effect);
    if (learnable != effects.end()) {
      learnable->values = stated.values;
    } else {
      stated.effect->apply(stated.values, {*family, stated.change_points}, base);
    }
  }
  rig::RunPlace place;
  constexpr double later_s = 60.0;
  for (const rig::SessionRun& run : session.runs) {
    const rig::RunPlace& done = run.drive.place;
    place.started_s = std::max(place.started_s, done.started_s + run.drive.end_s + later_s);
    place.cycles_before += static_cast<double>(done.trigger_s.size());
    place.largest_before_mL = std::max(place.largest_before_mL, done.largest_before_mL);
    place.atmosphere_kPa = done.atmosphere_kPa;
  }
  return {std::move(base), family, session.effects, std::move(effects), std::move(place), plan};
}

double rms_between(const PeriodicCurve& a, const PeriodicCurve& b) {
  const Eigen::Index count = std::max(a.harmonics(), b.harmonics());
  const Eigen::VectorXcd error = a.with(count).c - b.with(count).c;
  return std::sqrt(std::norm(error[0]) + 2.0 * error.tail(count).squaredNorm());
}

}  // namespace diastole::shaping
