#include "estimator/rig_fit/cycle_scatter.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "estimator/rig_fit/simulated_session.hpp"

namespace diastole::rig {
namespace {

using testing::SizeIs;

class Scatter : public testing::Test {
 protected:
  std::vector<CycleScatter> of(const Session& session) const {
    const SessionProblem problem(session, family_, 2);
    SessionModel model;
    model.nuisances = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(problem.nuisances().size()));
    model.nuisances[0] = (std::log(8.0) - problem.nuisances()[0].mean) / problem.nuisances()[0].sd;
    return cycle_scatter(problem, model);
  }
  SpecimenFamily family_ = gel_family();
};

Session long_session(const SpecimenFamily& family, const SessionOptions& options) {
  return simulated_session(family, options, {0.0, "parabolic", 40.0, 1.2, 0.0, 12});
}

TEST_F(Scatter, OfCyclesThatDifferByNoiseAndAFactorIsFarBelowTheNoise) {
  const auto found = of(long_session(family_, {.noise_kPa = 0.02, .cycle_sd = 0.004, .seed = 2}));
  ASSERT_THAT(found, SizeIs(2));
  EXPECT_LT(found[0].rms_kPa, 0.5 * found[0].noise_kPa);
  EXPECT_GT(found[0].noise_kPa, 0.005);
}

TEST_F(Scatter, IsTheSizeOfPickupWithAFrequencyOfItsOwn) {
  Session session = long_session(family_, {.noise_kPa = 0.02, .seed = 2});
  for (SessionRun& run : session.runs)
    for (size_t k = 0; k < run.sample_s.size(); ++k)
      if (run.sample_s[k] > 1.2)
        run.pressure_kPa[Channel::cavity][k] +=
            0.1 * std::sin(2 * std::numbers::pi * 3.1415 * run.sample_s[k]);
  const auto found = of(session);
  EXPECT_NEAR(found[0].rms_kPa, 0.1 / std::numbers::sqrt2, 0.02);
  EXPECT_GT(found[0].sds, 5.0);
  EXPECT_LT(found[1].rms_kPa, found[1].noise_kPa);
}

TEST_F(Scatter, OfNoiseAloneIsWithinItsError) {
  for (unsigned seed = 1; seed <= 20; ++seed)
    for (const CycleScatter& channel :
         of(long_session(family_, {.noise_kPa = 0.02, .cycle_sd = 0.004, .seed = seed})))
      EXPECT_LT(channel.sds, 3.0) << "seed " << seed;
}

TEST_F(Scatter, IsNotMadeByASingleEvent) {
  Session session = long_session(family_, {.noise_kPa = 0.02, .seed = 2});
  for (size_t k = 0; k < session.runs[0].sample_s.size(); ++k)
    if (session.runs[0].sample_s[k] > 8.3) session.runs[0].pressure_kPa[Channel::cavity][k] += 0.5;
  EXPECT_LT(of(session)[0].rms_kPa, 0.02);
}

}  // namespace
}  // namespace diastole::rig
