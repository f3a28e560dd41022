// Sessions of the rig's model with a law that the library lacks, and without: what is learnt of them.

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <optional>

#include "estimator/effect_files/effect_file.hpp"
#include "estimator/explain/rig/effect_trial.hpp"
#include "estimator/explain/rig/law_readings.hpp"
#include "estimator/explain/rig/learned_term.hpp"
#include "estimator/explain/rig/port_law.hpp"
#include "estimator/explain/rig/set_fit.hpp"
#include "estimator/rig_fit/simulated_session.hpp"

namespace diastole::explain {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// An effect of one parameter `a`, hidden at 1.
std::shared_ptr<const Effect> hidden(const std::string& port, const std::string& equation) {
  return effect_of_text(
      "format = \"diastole-effect\"\nversion = 1\nid = \"hidden\"\ntitle = \"hidden\"\nport = \"" + port +
      "\"\n[[parameter]]\nname = \"a\"\nneutral = 0.0\nbounds = [0.0, 2.0]\n[equations]\n" + equation + "\n");
}

/// Of eleven points that are outside once in ten, more than two are so in one session of eleven.
constexpr double least_inside = 9.0 / 11.0;

class LearnedTerms : public testing::Test {
 protected:
  struct Ended {};
  std::optional<LearnedTerm> learnt(const std::shared_ptr<const Effect>& effect, unsigned seed) {
    rig::SessionOptions options{.seed = seed};
    if (effect) {
      options.terms = {{effect.get(), {}}};
      options.values = {1.0};
    }
    rig::Session session = rig::simulated_session(family_, options);
    for (rig::SessionRun& run : session.runs)
      run.run_id = "id of " + run.drive.place.name;
    const rig::SessionProblem problem(session, family_, 2);
    const rig::LinearisedModel base = rig::declared_rig(problem);
    const EffectSet plain =
        fit_set_exactly(problem, fit_set(problem, base.at, base, problem.error().prior.share));
    Learning learning = learn_term(
        problem, plain, {},
        [this](std::string_view) {
          ++asked_;
          if (asked_ == ends_at_) throw Ended{};
        },
        most_rounds_);
    lacks_ = std::move(learning.lacks);
    return std::move(learning.term);
  }
  /// In how many of the curve's points its band holds the truth.
  static double part_inside(const LearnedTerm& term, const std::function<double(double)>& truth) {
    double inside = 0.0;
    for (size_t k = 0; k < term.curve.size(); ++k) {
      const double value = truth(term.curve[k][0]);
      if (term.band[k][0] <= value && value <= term.band[k][1]) inside += 1.0;
    }
    return inside / static_cast<double>(term.curve.size());
  }
  rig::SpecimenFamily family_ = rig::gel_family();
  std::string lacks_;
  size_t asked_ = 0;
  size_t ends_at_ = 0;
  int most_rounds_ = 4;
};

TEST_F(LearnedTerms, AreNotProposedWhereNothingIsMissing) {
  for (const unsigned seed : {11U, 12U}) {
    EXPECT_FALSE(learnt(nullptr, seed).has_value()) << seed;
    EXPECT_THAT(lacks_, Not(IsEmpty())) << seed;
  }
}

/// As on Ctrl-C: somewhere among the simulations of the first laws.
TEST_F(LearnedTerms, EndWhereSomebodyAsksFor) {
  ends_at_ = 9;
  EXPECT_THROW(learnt(nullptr, 11), Ended);
  EXPECT_EQ(asked_, ends_at_);
}

TEST_F(LearnedTerms, FindAFlapAtThePumpAndPredictOtherWaveforms) {
  const auto term =
      learnt(hidden("drive", "p_pump = \"p_pump + a * 20 [kPa] * max(q_hose / 100 [mL/s], 0)^2\""), 21);
  ASSERT_TRUE(term.has_value());
  EXPECT_EQ(term->port, "drive");
  EXPECT_EQ(term->sets, "p_pump");
  EXPECT_THAT(term->variables, ElementsAre("q_hose"));
  EXPECT_GT(term->gap.closed, 0.7);
  EXPECT_GE(part_inside(*term, [](double q) { return 20.0 * std::pow(std::max(q / 100.0, 0.0), 2); }),
            least_inside);
}

TEST_F(LearnedTerms, AreNotProposedBySearchesThatDidNotSettle) {
  most_rounds_ = 0;
  EXPECT_FALSE(
      learnt(hidden("drive", "p_pump = \"p_pump + a * 20 [kPa] * max(q_hose / 100 [mL/s], 0)^2\""), 21));
  EXPECT_THAT(lacks_, HasSubstr("its search did not settle. Stopped at the limit"));
}

TEST_F(LearnedTerms, FindFrictionOfTheSpecimen) {
  const auto term = learnt(hidden("specimen", "p = \"p + a * 0.6 [kPa] * tanh(dV / 20 [mL/s])\""), 22);
  ASSERT_TRUE(term.has_value());
  EXPECT_EQ(term->port, "specimen");
  EXPECT_EQ(term->sets, "p");
  EXPECT_EQ(term->variables.front(), "dV");
  EXPECT_GT(term->gap.closed, 0.7);
  EXPECT_GE(part_inside(*term, [](double dV) { return 0.6 * std::tanh(dV / 20.0); }), least_inside);
  EXPECT_THAT(term->readings.front(), HasSubstr("friction"));
}

/// What the specimen rests on while it is small: its pressure is lower by as much once it is off.
TEST_F(LearnedTerms, FindAContactAndWriteAFileThatSaysSo) {
  const auto term =
      learnt(hidden("specimen", "p = \"p - a * 1 [kPa] * min(max(V, 0 [mL]), 8 [mL]) / 8 [mL]\""), 23);
  ASSERT_TRUE(term.has_value());
  EXPECT_EQ(term->port, "specimen");
  EXPECT_THAT(term->variables, ElementsAre("V"));
  EXPECT_GT(term->gap.closed, 0.7);
  const auto effect = effect_of_text(term->toml);
  EXPECT_EQ(effect->text().port, Port::specimen);
  EXPECT_THAT(effect->text().learnt_from, ElementsAre("id of baseline", "id of sweep", "id of hold"));
  EXPECT_EQ(effect->text().conflicts.size(), term->rivals.size());
  const EffectTrial trial(*effect);
  for (const EffectCheck& check : {trial.declared(), trial.neutral(), trial.shows(), trial.bounded()})
    EXPECT_TRUE(check.passed) << check.name << ": " << check.detail;
}

class LawReadings : public testing::Test {
 protected:
  /// A curve that is known to a part of itself, by the flow into the hose.
  static LearnedTerm known_to(double part, const std::function<double(double)>& of) {
    LearnedTerm term;
    for (double q = -100.0; q <= 100.0; q += 20.0) {
      term.curve.push_back({q, of(q)});
      term.band.push_back({of(q) - part * std::abs(of(q)), of(q) + part * std::abs(of(q))});
    }
    return term;
  }
  static CurveEvidence evidence(const LearnedTerm& term, const Eigen::MatrixXd& precision) {
    Eigen::VectorXd curve(static_cast<Eigen::Index>(term.curve.size()));
    for (Eigen::Index k = 0; k < curve.size(); ++k)
      curve[k] = term.curve[static_cast<size_t>(k)][1];
    return {precision, precision * curve};
  }
  const PortLaw& law_ = port_laws().front();
};

TEST_F(LawReadings, GiveAFormulaWithItsValues) {
  ASSERT_EQ(law_.of, "q_hose");
  LearnedTerm term = known_to(0.01, [](double q) { return 4.0 * std::tanh(q / 25.0); });
  read_law(law_, evidence(term, 1e4 * Eigen::MatrixXd::Identity(11, 11)), term);
  EXPECT_EQ(term.closed_form, "a * tanh(q_hose / b), a = 4 [kPa], b = 25 [mL/s]");
}

TEST_F(LawReadings, GiveEveryLawItsFileAndWhatLooksLikeIt) {
  LearnedTerm term = known_to(0.01, [](double q) { return 0.04 * q; });
  read_law(law_, evidence(term, 1e4 * Eigen::MatrixXd::Identity(11, 11)), term,
           {.id = "learned-2", .learnt_from = {"run one", "run \"two\""}, .looks_alike = {"learned"}});
  const auto effect = effect_of_text(term.toml);
  const EffectDeclaration& text = effect->text();
  EXPECT_EQ(text.id, "learned-2");
  EXPECT_THAT(text.learnt_from, ElementsAre("run one", "run \"two\""));
  EXPECT_THAT(text.conflicts, ElementsAre("learned"));
}

TEST_F(LawReadings, ABandThatIsWideAlongOneCurveAdmitsNoOther) {
  // Nothing is known of a part in proportion to the flow, and the rest well: not in proportion.
  LearnedTerm term = known_to(2.0, [](double q) { return 4.0 * std::tanh(q / 25.0); });
  Eigen::VectorXd line = Eigen::VectorXd::LinSpaced(11, -1.0, 1.0).normalized();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(11, 11);
  read_law(law_, evidence(term, 1e4 * (identity - line * line.transpose()) + identity), term);
  EXPECT_EQ(term.closed_form, "a * tanh(q_hose / b), a = 4 [kPa], b = 25 [mL/s]");
}

}  // namespace
}  // namespace diastole::explain
