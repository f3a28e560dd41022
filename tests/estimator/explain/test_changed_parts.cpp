#include "estimator/explain/rig/changed_parts.hpp"

#include <gtest/gtest.h>

#include "estimator/rig_fit/simulated_session.hpp"

namespace diastole::explain {
namespace {

class ChangedParts : public testing::Test {
 protected:
  void SetUp() override {
    start_.nuisances =
        Eigen::VectorXd::LinSpaced(static_cast<Eigen::Index>(problem_.nuisances().size()), -1.0, 2.0);
    start_.terms = {{find_effect("hose-compliance"), {}}};
    start_.values = {80.0};
    known_.at = start_;
    known_.at.terms.clear();
    known_.at.values.clear();
    known_.columns = Eigen::MatrixXd::Random(7, start_.nuisances.size());
  }
  [[nodiscard]] Eigen::Index tolerances() const {
    return static_cast<Eigen::Index>(problem_.nuisances().size() - rig::basic_nuisances);
  }
  /// References that told much of every part, and that all are a bit off together.
  void learn() {
    problem_.set_tolerances(
        Eigen::VectorXd::Constant(tolerances(), 0.3),
        (0.01 * (Eigen::MatrixXd::Identity(tolerances(), tolerances()).array() + 0.5).matrix())
            .llt()
            .matrixL());
  }
  rig::SpecimenFamily family_ = rig::gel_family();
  rig::Session session_ = rig::simulated_session(family_, {});
  rig::SessionProblem problem_{session_, family_, 2};
  rig::SessionModel start_;
  rig::LinearisedModel known_;
};

TEST_F(ChangedParts, AreThoseThatTheEffectDeclares) {
  EXPECT_TRUE(is_changed(start_, "hose_bore"));
  EXPECT_FALSE(is_changed(start_, "drive_stroke"));
  EXPECT_FALSE(is_changed(known_.at, "hose_bore"));
}

TEST_F(ChangedParts, AreKnownAsOfAnyDeclaredRigAgain) {
  learn();
  const FreedStart free = free_changed_parts(problem_, start_, known_);
  const Eigen::MatrixXd& root = problem_.prior(free.start).root;
  const Eigen::VectorXd variance = (root * root.transpose()).diagonal();
  for (Eigen::Index i = 0; i < tolerances(); ++i) {
    const std::string& part = problem_.nuisances()[static_cast<size_t>(i) + rig::basic_nuisances].name;
    EXPECT_NEAR(variance[i], part.starts_with("hose_") ? 1.015 : 0.015, 1e-12) << part;
  }
}

TEST_F(ChangedParts, StayWhereTheyWere) {
  learn();
  const FreedStart free = free_changed_parts(problem_, start_, known_);
  EXPECT_TRUE(problem_.tolerances(free.start).isApprox(problem_.tolerances(start_), 1e-12));
  EXPECT_TRUE(problem_.tolerances(free.known.at).isApprox(problem_.tolerances(known_.at), 1e-12));
  // The same change of the parts shows the same.
  rig::SessionModel moved = free.start;
  moved.nuisances.tail(tolerances()).setLinSpaced(0.2, -0.4);
  const Eigen::VectorXd by = problem_.tolerances(moved) - problem_.tolerances(free.start);
  const Eigen::MatrixXd& before = problem_.prior(known_.at).root;
  const Eigen::VectorXd u_before = before.triangularView<Eigen::Lower>().solve(by);
  const Eigen::VectorXd u_after = (moved.nuisances - free.start.nuisances).tail(tolerances());
  EXPECT_TRUE((free.known.columns.rightCols(tolerances()) * u_after)
                  .isApprox(known_.columns.rightCols(tolerances()) * u_before, 1e-9));
  EXPECT_EQ(free.known.columns.leftCols(rig::basic_nuisances), known_.columns.leftCols(rig::basic_nuisances));
}

TEST_F(ChangedParts, AreLeftAloneWhereNothingWasLearntOrNothingChanges) {
  EXPECT_EQ(free_changed_parts(problem_, start_, known_).start.prior, nullptr);
  learn();
  EXPECT_EQ(free_changed_parts(problem_, known_.at, known_).start.prior, nullptr);
}

}  // namespace
}  // namespace diastole::explain
