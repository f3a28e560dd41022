// Data that other programs made (visibly skipped when they are not there): sound ones must be met with silence, and
// points of the reconstruction must lead to the stiffness that the tags themselves lead to.

#include <gtest/gtest.h>

#include "estimator/fit/study_fit.hpp"
#include "estimator/reconstruction/study_reconstruction.hpp"
#include "tests/recorded_data.hpp"

namespace diastole {
namespace {

class SoundData : public testing::TestWithParam<const char*> {};

TEST_P(SoundData, IsMetWithSilence) {
  const std::filesystem::path file = test::recorded("fe/" + std::string(GetParam()) + ".study.toml");
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
  const Study study = read_study(file);
  for (const Finding& finding : examine_measurement(study, read_measurement(study))) {
    if (finding.severity != Severity::note) ADD_FAILURE() << finding.id << ": " << finding.what;
  }
}

INSTANTIATE_TEST_SUITE_P(Recorded, SoundData,
                         testing::Values("phantom-a", "phantom-b", "field-001", "field-002", "field-003",
                                         "field-004", "field-005", "field-006", "field-007", "field-008",
                                         "field-009", "field-010", "field-011", "lv-a", "lv-clean"));

TEST(RecordedData, ReconstructedPointsGiveTheSameStiffness) {
  const std::filesystem::path file = test::recorded("fe/phantom-a.study.toml");
  const Study study = read_study(file);
  const Measurement measurement = read_measurement(study);
  const StudyReconstruction reconstruction = reconstruct_study(study, measurement, {});
  Measurement reconstructed{measurement.frames, {}, {}};
  for (const SampledFrame& frame : reconstruction.samples)
    reconstructed.points.insert(reconstructed.points.end(), frame.points.begin(), frame.points.end());
  const FittedParameter by_tags = fit_study(study, measurement, {}).parameters[0];
  const FittedParameter by_points = fit_study(study, reconstructed, {}).parameters[0];
  constexpr double truth_kPa = 8.71;
  EXPECT_LT(by_points.ci95[0], truth_kPa);
  EXPECT_GT(by_points.ci95[1], truth_kPa);
  EXPECT_GT(by_tags.value, by_points.ci95[0]);
  EXPECT_LT(by_tags.value, by_points.ci95[1]);
  // The points claim hardly more than the tags know, and not much less.
  EXPECT_GT(by_points.se, 0.9 * by_tags.se);
  EXPECT_LT(by_points.se, 1.5 * by_tags.se);
}

}  // namespace
}  // namespace diastole
