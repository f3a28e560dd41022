#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <span>

#include "estimator/rig_fit/base_fit.hpp"
#include "estimator/rig_fit/cycle_scatter.hpp"
#include "estimator/rig_fit/simulated_session.hpp"

namespace diastole::rig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

TEST(SegmentFeatures, OfNoiseAloneAreAsLargeAsTheirNoise) {
  const SpecimenFamily family = gel_family();
  const Session quiet = simulated_session(family, {.noise_kPa = 1e-6});
  const Session loud = simulated_session(family, {.noise_kPa = 0.02});
  const SegmentFeatures without(quiet, estimate_noise(quiet), 2);
  const SegmentFeatures with(loud, estimate_noise(loud), 2);
  ASSERT_EQ(without.count(), with.count());
  for (const Signal signal : {Signal::cavity, Signal::pump}) {
    double square = 0.0;
    double count = 0.0;
    for (const FeatureBlock& block : with.blocks()) {
      if (block.signal != signal) continue;
      for (size_t i = 0; i < block.features.size(); ++i) {
        const auto row = static_cast<Index>(block.first + i);
        square += std::pow((with.measured()[row] - without.measured()[row]) / block.features[i].noise_sd, 2);
        count += 1.0;
      }
    }
    EXPECT_GT(count, 100.0);
    EXPECT_NEAR(square / count, 1.0, 0.35) << name_of(signal);
  }
}

TEST(SegmentFeatures, KeepTheSquaresOfWhatTheirFunctionsHold) {
  const SpecimenFamily family = gel_family();
  const Session session = simulated_session(family, {});
  const SegmentFeatures features(session, estimate_noise(session), 1);
  const FeatureBlock& block = features.blocks().front();
  VectorXd wave(block.rows);
  for (Index k = 0; k < wave.size(); ++k)
    wave[k] = 3.0 + std::cos(2.0 * std::numbers::pi * block.cycles * static_cast<double>(k) /
                             static_cast<double>(wave.size()));
  EXPECT_NEAR(SegmentFeatures::project(block, wave).squaredNorm() / wave.squaredNorm(), 1.0, 1e-3);
}

// Of any series, whether its cycles are added up first or not.
TEST(SegmentFeatures, AreTheProductsWithTheirFunctions) {
  const SpecimenFamily family = gel_family();
  const Session session = simulated_session(family, {});
  const SegmentFeatures features(session, estimate_noise(session), 1);
  size_t cyclic = 0;
  for (const FeatureBlock& block : features.blocks()) {
    const VectorXd series = VectorXd::Random(block.rows);
    VectorXd expected(static_cast<Index>(block.basis.size()));
    for (size_t j = 0; j < block.basis.size(); ++j) {
      const FeatureBlock::Function& function = block.basis[j];
      expected[static_cast<Index>(j)] =
          function.values.cast<double>().dot(series.segment(function.first, function.values.size()));
    }
    block.factor.triangularView<Eigen::Lower>().solveInPlace(expected);
    EXPECT_LT((SegmentFeatures::project(block, series) - expected).norm(), 1e-6 * series.norm()) << block.key;
    cyclic += block.cyclic > 0 ? 1 : 0;
  }
  EXPECT_GT(cyclic, 0);
  EXPECT_LT(cyclic, features.blocks().size());
}

/// Features that are noise and a model's error of this share, in both groups of the cavity.
VectorXd errors_of(const ModelError& error, double share, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  VectorXd z(error.noise.size());
  for (Index i = 0; i < z.size(); ++i)
    z[i] = std::sqrt(error.noise[i] + share * share * error.unit[i]) * normal(generator);
  return z;
}

TEST(ModelError, ItsShareIsFoundWithinItsPrior) {
  const SpecimenFamily family = gel_family();
  const Session session = simulated_session(family, {});
  const ModelError error = model_error_of(SegmentFeatures(session, estimate_noise(session), 1));
  const Eigen::MatrixXd none(error.noise.size(), 0);
  for (const double share : {0.001, 0.005, 0.02}) {
    const EvidenceFit fit = fit_with_shares(errors_of(error, share, 7), none, error, error.prior.share);
    EXPECT_EQ(fit.termination, inference::Termination::converged);
    EXPECT_NEAR(std::log(fit.shares[0] / share), 0.0, 0.3) << share;
    EXPECT_GE(fit.log_evidence,
              fit_linear(errors_of(error, share, 7), none, error, error.prior.share).log_evidence);
  }
}

TEST(ModelError, ASearchOfItsSharesThatEndsTooEarlyReportsThat) {
  const SpecimenFamily family = gel_family();
  const Session session = simulated_session(family, {});
  const ModelError error = model_error_of(SegmentFeatures(session, estimate_noise(session), 1));
  const Eigen::MatrixXd none(error.noise.size(), 0);
  Shares far{};
  far.fill(1e20);  // fifty steps, as a rig takes whose leak a model does not have
  EXPECT_EQ(fit_with_shares(errors_of(error, 0.005, 7), none, error, far).termination,
            inference::Termination::converged);
  far.fill(1e100);  // more than two hundred steps of a factor of e away
  VectorXd z = errors_of(error, 0.005, 7);
  EXPECT_EQ(fit_with_shares(z, none, error, far).termination, inference::Termination::iteration_limit);
  z[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(fit_with_shares(z, none, error, error.prior.share).termination, inference::Termination::stalled);
}

TEST(SessionProblem, FindsTheModulusOfItsOwnModel) {
  const SpecimenFamily family = gel_family();
  const Session session = simulated_session(family, {});
  const SessionProblem problem(session, family, 2);
  const LinearisedModel rig = declared_rig(problem);
  EXPECT_NEAR(problem.model(rig.at).modulus_kPa, 8.0, 0.1);
  const EvidenceFit fit =
      fit_with_shares(rig.target(problem), rig.columns, problem.error(), problem.error().prior.share);
  EXPECT_LT(fit.surprise(problem.error().prior)[0], 1.0);
}

TEST(SessionProblem, KnowsTheModulusFromBoundsThatLeaveLessThanGelsDo) {
  Study study = gel_study();
  const Session session = simulated_session(gel_family(), {});
  for (const double ratio : {1.04, 2.0, 11.0, 12.0}) {
    StudyParameter& modulus = study.law.parameters.front();
    modulus = {"C1_kPa", 6.0, 5.0, 5.0 * ratio, Variation::whole};
    const SpecimenFamily family(study, {{4, 2, 1}, {4, 2, 1}, 16.0, 3, 1, 1});
    const Nuisance known = SessionProblem(session, family, 2).nuisances().front();
    const bool by_bounds = ratio < 11.5;
    EXPECT_NEAR(known.sd, by_bounds ? std::log(ratio) / std::sqrt(12.0) : 0.7, 1e-12) << ratio;
    EXPECT_NEAR(std::exp(known.mean), by_bounds ? 5.0 * std::sqrt(ratio) : 6.0, 1e-9) << ratio;
  }
}

TEST(SessionProblem, BearsAGap) {
  const SpecimenFamily family = gel_family();
  Session session = simulated_session(family, {});
  for (size_t k = 700; k < 720; ++k)
    session.runs[0].pressure_kPa[Channel::cavity][k] = std::numeric_limits<double>::quiet_NaN();
  const SessionProblem problem(session, family, 2);
  EXPECT_NEAR(problem.model(declared_rig(problem).at).modulus_kPa, 8.0, 0.1);
}

/// As when a transducer was connected for a further run, which is what explanations propose.
TEST(SessionProblem, TakesASensorThatOneRunAloneHas) {
  const SpecimenFamily family = gel_family();
  Session session = simulated_session(family, {});
  const SessionProblem whole(session, family, 2);
  for (size_t r = 0; r + 1 < session.runs.size(); ++r)
    session.runs[r].pressure_kPa.erase(Channel::pump);
  const SessionProblem problem(session, family, 2);
  std::vector<size_t> with_pump;
  for (const FeatureBlock& block : problem.features().blocks())
    if (block.signal == Signal::pump) with_pump.push_back(block.run);
  EXPECT_THAT(with_pump, testing::ElementsAre(session.runs.size() - 1));
  EXPECT_NEAR(problem.noise().channels.at(Channel::pump).sd_kPa,
              whole.noise().channels.at(Channel::pump).sd_kPa,
              0.3 * whole.noise().channels.at(Channel::pump).sd_kPa);
  const SessionModel model = declared_rig(problem).at;
  EXPECT_NEAR(problem.model(model).modulus_kPa, 8.0, 0.1);
  EXPECT_NO_THROW((void)cycle_scatter(problem, model));
}

/// Rms of what the problem's steps change of a signal's features, over that of the model's stated error.
std::array<double, signal_count> error_of_steps(const SessionProblem& problem, const SessionModel& of) {
  constexpr SimulationOptions converged{.step_s = 1.0 / 2400.0, .components = 3};
  const RigModel model = problem.model(of);
  Eigen::MatrixXd truth(problem.features().count(), 1);
  for (size_t r = 0; r < problem.session().runs.size(); ++r) {
    const SessionRun& run = problem.session().runs[r];
    const PlantTrace plant = simulate_plant(model, run.drive, converged);
    problem.features().project(
        r, std::array{RunPrediction{observe(model, plant, run.drive.place, run.sample_s), {}}}, truth);
  }
  const VectorXd off = problem.predicted_features(std::span(&of, 1)).col(0) - truth.col(0);
  const VectorXd stated = problem.error().variance(problem.error().prior.share) - problem.error().noise;
  std::array<double, signal_count> squares{}, of_error{};
  for (const FeatureBlock& block : problem.features().blocks()) {
    const auto first = static_cast<Index>(block.first), count = static_cast<Index>(block.features.size());
    squares[static_cast<size_t>(block.signal)] += off.segment(first, count).squaredNorm();
    of_error[static_cast<size_t>(block.signal)] += stated.segment(first, count).sum();
  }
  for (size_t s = 0; s < signal_count; ++s)
    squares[s] = of_error[s] > 0.0 ? std::sqrt(squares[s] / of_error[s]) : 0.0;
  return squares;
}

TEST(SessionProblem, ItsStepsErrByFarLessThanTheModel) {
  const SpecimenFamily family = gel_family();
  Session session = simulated_session(family, {});
  constexpr double of_smooth = 0.05, of_abrupt = 0.2;
  struct Case {
    const char* id;
    double value;
    double within;
  };
  for (const bool has_pump : {true, false}) {
    if (!has_pump)
      for (SessionRun& run : session.runs)
        run.pressure_kPa.erase(Channel::pump);
    const SessionProblem problem(session, family, 2);
    const SessionModel base = declared_rig(problem).at;
    for (const Case& one :
         {Case{nullptr, 0.0, of_smooth}, Case{"hose-compliance", 100.0, of_smooth},
          Case{"hose-loss-excess", 20.0, of_smooth}, Case{"backlash", 0.3, of_abrupt},
          Case{"seal-leak-pump", 0.02, of_abrupt}, Case{"air-bubble-pump", 1.5, of_abrupt}}) {
      SessionModel with = base;
      if (one.id != nullptr) {
        with.terms = {{find_effect(one.id), {}}};
        with.values = find_effect(one.id)->neutral(problem.model(base));
        with.values[0] = one.value;
      }
      const auto errors = error_of_steps(problem, with);
      EXPECT_LT(std::ranges::max(errors), one.within) << (one.id ? one.id : "as described") << has_pump;
    }
  }
}

TEST(SessionProblem, ItsSlopesAreTheDifferencesOfShortSteps) {
  const SpecimenFamily family = gel_family();
  const Session session = simulated_session(family, {});
  const SessionProblem problem(session, family, 2);
  SessionModel at = declared_rig(problem).at;
  VectorXd there;
  const Eigen::MatrixXd slopes = problem.nuisance_slopes(at, there);
  EXPECT_EQ(there, problem.predicted_features(std::span(&at, 1)).col(0));
  const Eigen::MatrixXd both_sides = problem.nuisance_slopes(at, there, true);
  EXPECT_EQ(there, problem.predicted_features(std::span(&at, 1)).col(0));
  constexpr double step = 0.005;
  for (Index i = 0; i < slopes.cols(); ++i) {
    SessionModel before = at, after = at;
    before.nuisances[i] -= step;
    after.nuisances[i] += step;
    const Eigen::MatrixXd shown = problem.predicted_features(std::array{before, after});
    const VectorXd central = (shown.col(1) - shown.col(0)) / (2.0 * step);
    // An error of a twentieth costs a search a step; a drive that hardly yields is the most curved, with two per cent.
    EXPECT_LE((slopes.col(i) - central).norm(), 0.05 * central.norm() + 1e-4)
        << problem.nuisances()[static_cast<size_t>(i)].name;
    EXPECT_LE((both_sides.col(i) - central).norm(), 1e-9 * central.norm() + 1e-9)
        << problem.nuisances()[static_cast<size_t>(i)].name;
  }
}

TEST(Tolerances, MoveThePistonByMotionsWhoseDerivativesTheyKnow) {
  const SpecimenFamily family = gel_family();
  size_t of_drive = 0;
  for (const Tolerance& tolerance : all_tolerances()) {
    RigModel model;
    model.curve = family.plain();
    tolerance.apply(tolerance.sd, {family, {}, true}, model);
    DriveTrace commanded{0.0, 1e-3, {}, {}, {}};
    for (int k = 0; k < 2000; ++k) {
      const double angle = std::numbers::pi * commanded.step_s * k;
      commanded.volume_mL.push_back(20.0 * (1.0 - std::cos(angle)));
      commanded.flow_mL_per_s.push_back(20.0 * std::numbers::pi * std::sin(angle));
      commanded.acceleration_mL_per_s2.push_back(20.0 * std::pow(std::numbers::pi, 2) * std::cos(angle));
    }
    const DriveTrace trace = driven(model, {}, commanded);
    if (trace.volume_mL == commanded.volume_mL) continue;
    DriveTrace differences = trace;
    differences.differentiate();
    for (size_t k = 10; k + 10 < trace.volume_mL.size(); ++k) {
      EXPECT_NEAR(trace.flow_mL_per_s[k], differences.flow_mL_per_s[k], 0.01) << tolerance.name;
      EXPECT_NEAR(trace.acceleration_mL_per_s2[k], differences.acceleration_mL_per_s2[k], 0.1)
          << tolerance.name;
    }
    ++of_drive;
  }
  EXPECT_EQ(of_drive, 5U);  // the stroke, and the two parts of the screw's error and of the coupling's
}

/// Where a drive stands that was to be at these volumes, a turn of its screw being 8 mL.
std::vector<double> moved_by(std::string_view name, double size_mL, std::vector<double> volume_mL) {
  const SpecimenFamily family = gel_family();
  RigModel model;
  model.curve = family.plain();
  std::ranges::find(all_tolerances(), name, &Tolerance::name)->apply(size_mL, {family, {}, true}, model);
  const std::vector<double> none(volume_mL.size());
  RunPlace place;
  place.turn_mL = 8.0;
  return driven(model, place, {0.0, 1e-3, std::move(volume_mL), none, none}).volume_mL;
}

TEST(Tolerances, OfScrewAndCouplingHaveTheScrewsOwnTurn) {
  using testing::DoubleNear;
  using testing::ElementsAre;
  const auto at = [](double value) { return DoubleNear(value, 1e-12); };
  EXPECT_THAT(moved_by("screw_sine", 0.02, {0.0, 2.0, 4.0, 8.0}), ElementsAre(at(0), at(2.02), at(4), at(8)));
  EXPECT_THAT(moved_by("coupling_sine", 0.01, {0.0, 1.0, 2.0, 5.0}),
              ElementsAre(at(0), at(1.01), at(2), at(5.01)));
  EXPECT_THAT(moved_by("coupling_cosine", 0.01, {0.0, 1.0, 2.0, 4.0}),
              ElementsAre(at(0), at(1.01), at(2.02), at(4)));
}

TEST(Tolerances, OfTheCouplingAreUnknownsWhereTheyWereLearntOrStated) {
  const SpecimenFamily family = gel_family();
  Session session = simulated_session(family, {});
  const auto unknown = [&](std::string_view name, std::span<const std::string_view> learnt) {
    const SessionProblem problem(session, family, 2, learnt);
    return std::ranges::count(problem.nuisances(), name, &Nuisance::name) == 1;
  };
  EXPECT_TRUE(unknown("screw_sine", {}));
  EXPECT_FALSE(unknown("coupling_sine", {}));
  constexpr std::array<std::string_view, 1> sine{"coupling_sine"};
  EXPECT_TRUE(unknown("coupling_sine", sine));
  EXPECT_FALSE(unknown("coupling_cosine", sine));
  session.tolerance_sd["coupling_cosine"] = 0.02;
  EXPECT_TRUE(unknown("coupling_cosine", {}));
}

TEST(SimulatedPlant, CopiesCyclesThatRepeatThemselves) {
  const SpecimenFamily family = gel_family();
  RigModel model;
  model.curve = family.plain();
  SessionRun run = empty_run("baseline", {0.0, "parabolic", 40.0, 1.2, 0.0, 24}, 0.0);
  const PlantTrace all = simulate_plant(model, run.drive);
  run.drive.repetitions = {{1.2, 1.2, 24}};
  const PlantTrace copied = simulate_plant(model, run.drive);
  ASSERT_EQ(copied.cavity_kPa.size(), all.cavity_kPa.size());
  const double range_kPa = *std::ranges::max_element(all.cavity_kPa);
  size_t alike = 0;
  for (size_t k = 0; k < all.cavity_kPa.size(); ++k) {
    EXPECT_NEAR(copied.cavity_kPa[k], all.cavity_kPa[k], 1e-5 * range_kPa) << k;
    if (k >= 720 && copied.cavity_kPa[k] == copied.cavity_kPa[k - 720]) ++alike;
  }
  EXPECT_GT(alike, 10 * 720);  // a cycle is 720 steps: most were copied
}

}  // namespace
}  // namespace diastole::rig
