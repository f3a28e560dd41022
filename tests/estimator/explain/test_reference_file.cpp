#include "estimator/explain/rig/reference_file.hpp"

#include <gmock/gmock.h>

#include "protocol/contract/input_error.hpp"

namespace diastole::explain {
namespace {

TEST(Reference, IsReadAsItWasWritten) {
  Reference reference;
  reference.tolerances = {"hose_length", "hose_bore"};
  reference.mean = Eigen::Vector2d(0.5, -1.0);
  reference.covariance = Eigen::Matrix2d{{0.25, 0.1}, {0.1, 0.5}};
  reference.segments["sinusoidal"] = {Eigen::VectorXd::LinSpaced(3, 1.0, 3.0),
                                      Eigen::VectorXd::Constant(3, 0.5)};
  reference.all.fill(0.004);
  reference.again.fill(0.002);
  reference.rms = {0.012, 0.5, 0.0};
  reference.percent_of_range = {0.3, 1.1, 0.0};
  reference.sessions = 2;
  reference.fingerprint = "0badcafe";
  reference.termination = inference::Termination::stalled;
  const std::string text = to_json(reference);
  EXPECT_THAT(text, testing::HasSubstr("\"termination\":\"stalled\""));
  const Reference read = reference_from_json(text, "rig.reference.json");
  EXPECT_EQ(read.tolerances, reference.tolerances);
  EXPECT_EQ(read.covariance, reference.covariance);
  EXPECT_EQ(read.segments.at("sinusoidal").misfit, reference.segments["sinusoidal"].misfit);
  EXPECT_EQ(read.again, reference.again);
  EXPECT_DOUBLE_EQ(read.rms[0], 0.012);
  EXPECT_EQ(read.fingerprint, "0badcafe");
  EXPECT_EQ(read.termination, inference::Termination::stalled);
}

TEST(Reference, TeachesOfTheCouplingWhatItTellsMoreOfThanIsKnownOfAny) {
  Reference reference;
  EXPECT_THAT(learnt_tolerances(reference), testing::IsEmpty());
  reference.tolerances = {"screw_sine", "coupling_sine", "coupling_cosine"};
  reference.covariance = Eigen::Vector3d(0.1, 0.1, 0.9).asDiagonal();
  EXPECT_THAT(learnt_tolerances(reference), testing::ElementsAre("coupling_sine"));
}

TEST(Reference, OfAnotherRigIsRefusedWithBothHoses) {
  Reference reference;
  reference.covariance.resize(0, 0);
  reference.hose_length_m = 4.7;
  reference.hose_bore_mm = 14.0;
  reference = reference_from_json(to_json(reference), "rig.reference.json");
  Study study;
  study.file = "today.study.toml";
  rig::Session session;
  session.base.hose.length_m = 4.7;
  session.base.hose.bore_mm = 14.0;
  EXPECT_NO_THROW(require_rig_of(reference, session, study));
  session.base.hose.length_m = 5.3;
  try {
    require_rig_of(reference, session, study);
    ADD_FAILURE() << "another rig's reference was taken";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr("today.study.toml"),
                                             testing::HasSubstr("5.3 m"), testing::HasSubstr("4.7 m")));
  }
}

TEST(Reference, ThatIsNoneIsRefusedWithItsFile) {
  for (const char* text :
       {"", "{}", R"({"format": "diastole-reference", "format_version": 1, "channels": {}})"}) {
    try {
      (void)reference_from_json(text, "rig.reference.json");
      ADD_FAILURE() << text;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("rig.reference.json"));
    }
  }
}

}  // namespace
}  // namespace diastole::explain
