#include "estimator/explain/rig/reference_json.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "protocol/contract/input_error.hpp"
#include "tests/estimator/io/scratch_file.hpp"

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

std::string refusal_of(const std::string& text) {
  return test::message_of([&] { (void)reference_from_json(text, "rig.reference.json"); });
}

TEST(Reference, ThatIsNoneIsRefusedWithItsFile) {
  EXPECT_THAT(refusal_of(""), testing::HasSubstr("rig.reference.json: line 1, column 1: is not a reference"));
  EXPECT_THAT(refusal_of("{\n\"a\": }"), testing::HasSubstr("line 2, column 6: is not a reference"));
  EXPECT_THAT(refusal_of("{}"), testing::HasSubstr("rig.reference.json: key format: is not"));
}

/// A reference's document that `spoil` has changed.
std::string refusal_of_spoilt(const std::function<void(nlohmann::json&)>& spoil) {
  Reference reference;
  reference.tolerances = {"hose_length"};
  reference.mean = Eigen::VectorXd::Constant(1, 0.5);
  reference.covariance = Eigen::MatrixXd::Constant(1, 1, 0.25);
  reference.segments["hold"] = {Eigen::Vector2d(1, 2), Eigen::Vector2d(1, 1)};
  reference.rms = {0.012, 0.5, 0.0};
  auto document = nlohmann::json::parse(to_json(reference));
  spoil(document);
  return refusal_of(document.dump());
}

TEST(Reference, ThatLacksSomethingIsRefusedWithItsPlaceInWordsOfOurs) {
  using testing::HasSubstr;
  for (const char* key : {"format_version", "channels", "fingerprint", "sessions", "termination", "shares",
                          "tolerances", "segments"}) {
    const std::string refusal = refusal_of_spoilt([&](auto& document) { document.erase(key); });
    EXPECT_THAT(refusal, HasSubstr(fmt::format("rig.reference.json: key {}: is missing", key)));
    EXPECT_THAT(refusal, HasSubstr("diastole reference STUDY"));
    EXPECT_THAT(refusal, testing::Not(HasSubstr("json.exception")));
  }
  EXPECT_THAT(refusal_of_spoilt([](auto& document) { document["shares"].erase("again"); }),
              HasSubstr("key shares.again: is missing"));
  EXPECT_THAT(refusal_of_spoilt([](auto& document) {
                document["shares"]["all"] = {1, 2};
              }),
              HasSubstr("key shares.all: is no list of 5"));
  EXPECT_THAT(refusal_of_spoilt([](auto& document) { document["tolerances"]["names"] = {7}; }),
              HasSubstr("key tolerances.names[0]: 7 is no text"));
  EXPECT_THAT(refusal_of_spoilt([](auto& document) { document["tolerances"]["mean"][0] = nullptr; }),
              HasSubstr("key tolerances.mean[0]: is no number"));
  EXPECT_THAT(refusal_of_spoilt([](auto& document) { document["tolerances"]["covariance"] = {-1}; }),
              HasSubstr("key tolerances.covariance: is no covariance"));
  EXPECT_THAT(refusal_of_spoilt([](auto& document) { document["segments"]["hold"]["noise"] = {1}; }),
              HasSubstr("key segments.hold: has 2 misfits and 1 noises"));
  EXPECT_THAT(refusal_of_spoilt([](auto& document) { document["channels"]["cavity_kPa"].erase("rms_Pa"); }),
              HasSubstr("key channels.cavity_kPa: has neither"));
}

}  // namespace
}  // namespace diastole::explain
