#include "estimator/shaping/learning.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>

#include "estimator/shaping/model_fit.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole::shaping {
namespace {

using Complex = std::complex<double>;

constexpr double gain_prior_sd = 0.1;
constexpr double shift_prior_part = 0.005;  // of the wanted range
constexpr double model_part = 0.4;  // of that, by which the model may err from run to run: 0.2 % of the range
constexpr double most_growth = 2.0;  ///< of a drive's range over the first one's: beyond it something leaks
constexpr double most_rise =
    0.25;  ///< of a drive's least volume over the first one's, in ranges of the first
constexpr double surprise_allowed = 0.05;  ///< of the range, beside what was meant to change

/// Posterior of c and d of one harmonic.
struct Posterior {
  Complex gain = 1.0;
  double gain_sd = gain_prior_sd;
};

/// Of Y = c M + d with independent errors.
Posterior posterior(const std::vector<Complex>& modelled, const std::vector<Complex>& seen,
                    const std::vector<double>& sigma, double shift_sd) {
  Eigen::Matrix2cd information = Eigen::Matrix2cd::Zero();
  information(0, 0) = 1.0 / (gain_prior_sd * gain_prior_sd);
  information(1, 1) = 1.0 / (shift_sd * shift_sd);
  Eigen::Vector2cd right(information(0, 0), 0.0);
  for (size_t i = 0; i < seen.size(); ++i) {
    if (!std::isfinite(sigma[i])) continue;
    const double weight = 1.0 / (sigma[i] * sigma[i] + model_part * model_part * shift_sd * shift_sd);
    const Eigen::Vector2cd row(modelled[i], 1.0);
    information += weight * row.conjugate() * row.transpose();
    right += weight * row.conjugate() * seen[i];
  }
  const Eigen::Matrix2cd covariance = information.inverse();
  return {(covariance * right)[0], std::sqrt(covariance(0, 0).real())};
}

/// The runs and what the model makes of their drives.
struct Evidence {
  const PeriodicCurve& wanted_mL;
  const std::vector<GatedRun>& runs;
  double range_mL;
  DriveModel model;                         ///< as the runs have corrected it
  std::vector<PeriodicCurve> from_rest_mL;  ///< drives (drive_from_rest)
  std::vector<PeriodicCurve> modelled_mL;   ///< volumes with them
  std::vector<double> modelled_kPa;         ///< greatest pressures with them

  /// From the first `count` runs.
  [[nodiscard]] std::vector<Posterior> posteriors(size_t count, Eigen::Index harmonics) const {
    std::vector<Posterior> list;
    for (Eigen::Index k = 0; k <= harmonics; ++k) {
      std::vector<Complex> modelled, seen;
      std::vector<double> sigma;
      for (size_t i = 0; i < count; ++i) {
        modelled.push_back(modelled_mL[i].c[k]);
        seen.push_back(runs[i].cavity_mL.curve.c[k]);
        sigma.push_back(runs[i].cavity_mL.sigma[k]);
      }
      list.push_back(k == 0 ? Posterior{} : posterior(modelled, seen, sigma, shift_prior_part * range_mL));
    }
    return list;
  }
  /// Root mean square about the mean over the harmonics that the run has measured, over the range.
  [[nodiscard]] double part(size_t run, const Eigen::VectorXcd& error) const {
    const Eigen::VectorXd& sigma = runs[run].cavity_mL.sigma;
    double sum = 0.0;
    for (Eigen::Index k = 1; k < std::min(error.size(), sigma.size()); ++k)
      if (std::isfinite(sigma[k])) sum += 2.0 * std::norm(error[k]);
    return std::sqrt(sum) / range_mL;
  }
  [[nodiscard]] Eigen::VectorXcd error(size_t run) const {
    const PeriodicCurve& seen = runs[run].cavity_mL.curve;
    return wanted_mL.with(seen.harmonics()).c - seen.c;
  }
  /// By how much the specimen held more than the model makes of it.
  [[nodiscard]] double held_beside_kPa(size_t run) const {
    return std::max(runs[run].greatest_kPa - modelled_kPa[run], 0.0);
  }
  /// What the run was expected to show, from run `from` and what was learned of the `count` runs before.
  [[nodiscard]] Eigen::VectorXcd expected(size_t run, std::optional<size_t> from, size_t count,
                                          Eigen::Index harmonics) const {
    if (!from) return modelled_mL[run].with(harmonics).c;
    Eigen::VectorXcd volume = runs[*from].cavity_mL.curve.with(harmonics).c;
    const std::vector<Posterior> known = posteriors(count, harmonics);
    for (Eigen::Index k = 0; k <= harmonics; ++k)
      volume[k] += known[static_cast<size_t>(k)].gain * (modelled_mL[run].c[k] - modelled_mL[*from].c[k]);
    return volume;
  }
};

Iteration iteration_of(const Evidence& evidence, size_t run) {
  const GatedRun& gated = evidence.runs[run];
  Iteration it{.run = gated.file, .source = gated.source};
  it.drive_mL = gated.drive_mL;
  it.cavity_mL = gated.cavity_mL.curve;
  const Eigen::VectorXcd error = evidence.error(run);
  it.nrmse = evidence.part(run, error);
  it.level_error_mL = -error[0].real();
  it.level_sd_mL = gated.cavity_mL.sigma[0];
  it.floor = evidence.part(run, gated.cavity_mL.sigma.cast<Complex>());
  return it;
}

/// Runs one after the other: how good each was, which is the best, and whether learning has to end.
void judge(const Evidence& evidence, Eigen::Index harmonics, Lesson& lesson) {
  size_t worse = 0;
  for (size_t run = 0; run < evidence.runs.size() && lesson.ending != Ending::changed; ++run) {
    Iteration it = iteration_of(evidence, run);
    const Eigen::VectorXcd expected = evidence.expected(run, lesson.best, run, harmonics);
    it.surprise = evidence.part(run, evidence.runs[run].cavity_mL.curve.with(harmonics).c - expected);
    const double meant =
        lesson.best
            ? evidence.part(run, expected - evidence.runs[*lesson.best].cavity_mL.curve.with(harmonics).c)
            : 0.0;
    if (const auto cycle = evidence.runs[run].changed_in_cycle) {
      lesson.ending = Ending::changed;
      lesson.reason = fmt::format(
          "{}: from cycle {} on the pressure does not go on as before: something leaks, slips or "
          "has burst",
          it.run, *cycle + 1);
    } else if (lesson.best && it.surprise > surprise_allowed + meant + 3.0 * it.floor) {
      lesson.ending = Ending::changed;
      lesson.reason =
          fmt::format("{}: its volume is {:.1f} % of the range off what the runs before let expect", it.run,
                      100.0 * it.surprise);
    } else if (!lesson.best || it.nrmse < lesson.iterations[*lesson.best].nrmse) {
      lesson.best = run;
      worse = 0;
    } else if (it.nrmse > lesson.iterations[*lesson.best].nrmse + it.floor) {
      ++worse;
    }
    lesson.iterations.push_back(std::move(it));
  }
  if (lesson.ending != Ending::none) return;
  if (worse >= 2) {
    lesson.ending = Ending::diverging;
    lesson.reason = "two runs in a row were worse than the best one";
  }
}

/// Noise makes an error of `floor` give or take its own scatter.
bool at_floor(const Iteration& best, Eigen::Index harmonics) {
  const double scatter = std::sqrt(2.0 / static_cast<double>(2 * harmonics + 1));
  return best.nrmse <= best.floor * std::sqrt(1.0 + 2.0 * scatter);
}

void describe_harmonics(const Evidence& evidence, const std::vector<Posterior>& known, Lesson& lesson) {
  const size_t runs = lesson.iterations.size();
  for (size_t i = 0; i < known.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    LearnedHarmonic& harmonic = lesson.harmonics.emplace_back();
    harmonic.frequency_Hz = evidence.wanted_mL.frequency_Hz(k);
    harmonic.gain = std::abs(known[i].gain);
    harmonic.phase_deg = std::arg(known[i].gain) / rad_per_deg;
    harmonic.gain_sd = known[i].gain_sd;
    harmonic.contraction_expected = known[i].gain_sd / std::hypot(harmonic.gain, known[i].gain_sd);
    if (runs < 2) continue;
    const double before = std::abs(evidence.error(runs - 2)[k]), now = std::abs(evidence.error(runs - 1)[k]);
    if (before > 2.0 * evidence.runs[runs - 2].cavity_mL.sigma[k]) harmonic.contraction_found = now / before;
  }
}

/// The volume that the model has to make so that the rig makes the wanted one: less what the best run showed beside the model and its
/// noise.
PeriodicCurve wanted_of_model(const Evidence& evidence, size_t best, Eigen::Index harmonics) {
  PeriodicCurve wanted = evidence.wanted_mL.with(harmonics);
  for (Eigen::Index k = 1; k <= harmonics; ++k) {
    const double sigma = evidence.runs[best].cavity_mL.sigma[k];
    const Complex beside = evidence.runs[best].cavity_mL.curve.c[k] - evidence.modelled_mL[best].c[k];
    if (std::norm(beside) > sigma * sigma) wanted.c[k] -= (1.0 - sigma * sigma / std::norm(beside)) * beside;
  }
  return wanted;
}

/// By how much the specimen is filled when the next run begins: as the last one began, and what that one left.
double next_beginning_mL(const Evidence& evidence) {
  const size_t last = evidence.runs.size() - 1;
  const double began_mL = evidence.from_rest_mL[last].c[0].real() - evidence.runs[last].drive_mL.c[0].real();
  return began_mL + evidence.model.response(evidence.from_rest_mL[last], 1).left_mL;
}

/// The step from the best run towards the wanted curve, of drives from rest.
Eigen::VectorXcd step_from(const Evidence& evidence, size_t best, const std::vector<Posterior>& known,
                           Eigen::Index harmonics) {
  const PeriodicCurve from = evidence.from_rest_mL[best].with(harmonics);
  const PeriodicCurve drive = evidence.model.inverse(wanted_of_model(evidence, best, harmonics), from);
  Eigen::VectorXcd step = drive.c - from.c;
  for (Eigen::Index k = 1; k <= harmonics; ++k) {
    const Posterior& here = known[static_cast<size_t>(k)];
    step[k] *= std::conj(here.gain) / (std::norm(here.gain) + here.gain_sd * here.gain_sd);
  }
  return step;
}

/// No drive grows far beyond the model's own: it would push into a leak.
Eigen::VectorXcd guarded(const PeriodicCurve& from, Eigen::VectorXcd step, double most_mL, Lesson& lesson) {
  for (int halving = 0; halving < 20; ++halving) {
    if (PeriodicCurve{from.period_s, from.c + step}.range() <= most_mL) return step;
    lesson.bounded = lesson.guarded = true;
    step *= 0.5;
  }
  return Eigen::VectorXcd::Zero(step.size());
}

double greatest_mL(const PeriodicCurve& drive) { return drive.at(drive.least_at_s()) + drive.range(); }

/// Nor does its level rise far: a leak that goes on, or a transducer's zero that drifts, asks for more in each run.
/// Beyond twice the first drive's greatest volume learning ends.
void guard_level(const PeriodicCurve& first_mL, PeriodicCurve& asked_mL, Lesson& lesson) {
  const double greatest = greatest_mL(asked_mL), most = most_growth * greatest_mL(first_mL);
  if (greatest > most) {
    lesson.ending = Ending::changed;
    lesson.reason = fmt::format(
        "the next drive would reach {:.1f} mL, and the first one reached {:.1f} mL: something leaks, or the "
        "transducer's zero drifts",
        greatest, greatest_mL(first_mL));
    return;
  }
  const double rise_mL = asked_mL.at(asked_mL.least_at_s()) - first_mL.at(first_mL.least_at_s());
  const double beyond_mL = rise_mL - most_rise * first_mL.range();
  if (beyond_mL <= 0.0) return;
  lesson.bounded = lesson.guarded = true;
  asked_mL.c[0] -= beyond_mL;
}

/// The next drive, and whether what it promises is worth a run.
void plan_next(const Evidence& evidence, const PeriodicCurve& first_mL, const Bound& bound, Lesson& lesson) {
  constexpr double worth_while = 0.9;
  const Eigen::Index harmonics = first_mL.harmonics();
  const std::vector<Posterior> known = evidence.posteriors(lesson.iterations.size(), harmonics);
  const PeriodicCurve from = evidence.from_rest_mL[*lesson.best].with(harmonics);
  const double beginning_mL = next_beginning_mL(evidence);
  Eigen::VectorXcd step = step_from(evidence, *lesson.best, known, harmonics);
  if (*lesson.best + 1 < lesson.iterations.size()) step *= 0.5;  // the last one went too far
  step = guarded(from, step, most_growth * first_mL.range(), lesson);
  const Eigen::MatrixXd slope = evidence.model.jacobian(from);
  PeriodicCurve asked{from.period_s, from.c + step};
  asked.c[0] -= beginning_mL;
  guard_level(first_mL, asked, lesson);
  if (lesson.ending != Ending::none) return;
  lesson.drive_mL = bound(asked, slope);
  lesson.bounded = lesson.bounded || rms_between(asked, lesson.drive_mL) > 1e-6 * evidence.range_mL;
  PeriodicCurve next = lesson.drive_mL;
  next.c[0] += beginning_mL;
  const Eigen::Index seen = evidence.runs[*lesson.best].cavity_mL.curve.harmonics();
  const ModelResponse response = evidence.model.response(next, seen);
  lesson.greatest_kPa = response.greatest_kPa + evidence.held_beside_kPa(*lesson.best);
  lesson.expected_mL = response.cavity_mL;
  lesson.expected_mL.c +=
      evidence.runs[*lesson.best].cavity_mL.curve.c - evidence.modelled_mL[*lesson.best].c;
  const double left = evidence.part(
      *lesson.best, evidence.wanted_mL.with(lesson.expected_mL.harmonics()).c - lesson.expected_mL.c);
  if (left > worth_while * lesson.iterations[*lesson.best].nrmse) {
    lesson.ending = Ending::converged;
    lesson.reason = fmt::format("another run promises {:.2f} % instead of {:.2f} %", 100.0 * left,
                                100.0 * lesson.iterations[*lesson.best].nrmse);
  }
}

}  // namespace

std::string in_words(Ending ending) {
  switch (ending) {
    case Ending::floor:
      return "noise floor";
    case Ending::converged:
      return "converged";
    case Ending::diverging:
      return "diverging";
    case Ending::changed:
      return "changed";
    case Ending::none:
      break;
  }
  return "goes on";
}

Lesson learn(const DriveModel& model, const PeriodicCurve& wanted_mL, const PeriodicCurve& first_mL,
             const std::vector<GatedRun>& runs, const Bound& bound) {
  const Eigen::Index harmonics = first_mL.harmonics();
  Lesson lesson;
  const double range_mL = wanted_mL.range();
  Evidence evidence{wanted_mL, runs, range_mL, fitted_model(model, runs, range_mL), {}, {}, {}};
  for (const GatedRun& run : runs) {
    evidence.from_rest_mL.push_back(drive_from_rest(evidence.model, run, &run == &runs.front()));
    const ModelResponse modelled =
        evidence.model.response(evidence.from_rest_mL.back(), run.cavity_mL.curve.harmonics());
    evidence.modelled_mL.push_back(modelled.cavity_mL);
    evidence.modelled_kPa.push_back(modelled.greatest_kPa);
  }
  for (const LearnableEffect& one : evidence.model.effects())
    for (size_t i = 0; i < one.values.size(); ++i)
      lesson.model.push_back(
          {std::string(one.effect->text().id), std::string(one.effect->parameters()[i].name), one.values[i]});
  judge(evidence, harmonics, lesson);
  describe_harmonics(evidence, evidence.posteriors(lesson.iterations.size(), harmonics), lesson);
  if (!lesson.best) {
    lesson.drive_mL = first_mL;
    const ModelResponse expected = model.response(first_mL, 2 * harmonics);
    lesson.expected_mL = expected.cavity_mL;
    lesson.greatest_kPa = expected.greatest_kPa;
    return lesson;
  }
  const Iteration& best = lesson.iterations[*lesson.best];
  if (lesson.ending == Ending::none && at_floor(best, best.cavity_mL.harmonics())) {
    lesson.ending = Ending::floor;
    lesson.reason = fmt::format("the error of {:.2f} % is what noise alone makes", 100.0 * best.nrmse);
  }
  if (lesson.ending == Ending::none) plan_next(evidence, first_mL, bound, lesson);
  if (lesson.ending != Ending::none) {
    lesson.drive_mL = best.drive_mL.with(harmonics);
    lesson.expected_mL = best.cavity_mL;
    lesson.greatest_kPa = evidence.modelled_kPa[*lesson.best] + evidence.held_beside_kPa(*lesson.best);
  }
  return lesson;
}

}  // namespace diastole::shaping
