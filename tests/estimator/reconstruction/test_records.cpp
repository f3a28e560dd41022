// What leaves a reconstruction: the record and its file, the points, the grid, the report.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "estimator/reconstruction/reconstruction_record.hpp"
#include "estimator/report/report.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tests/estimator/reconstruction/tagged_motion.hpp"

namespace diastole {
namespace {

using testing::HasSubstr;

class Records : public testing::Test {
 protected:
  Records() {
    study_.file = "gel.study.toml";
    study_.specimen = AnnulusSpecimen{22.5, 50.0, 85.0, {4, 2, 1}, "fixed"};
    study_.law = {"neo-hookean", {{"C1_kPa", 6.0, 1.0, 15.0, Variation::whole}}};
    options_.check_stiffness = false;
    reconstruction_ = reconstruct_study(study_, measurement_, options_);
    record_ = reconstruction_record(study_, measurement_, options_, reconstruction_);
  }

  Study study_{};
  Measurement measurement_ = test::tagged_inflation(
      test::small_gel(), 4.0, {.tags_a_frame = 400, .wild_share = 0.02, .frames = {0, 2, 4}});
  ReconstructionOptions options_;
  StudyReconstruction reconstruction_;
  ReconstructionRecord record_;
};

TEST_F(Records, AFileGivesTheRecordBack) {
  const std::string text = to_json(record_);
  EXPECT_TRUE(is_reconstruction(text));
  const ReconstructionRecord back = reconstruction_record_from_json(text, "gel.json");
  EXPECT_EQ(to_json(back), text);
  ASSERT_EQ(back.frames.size(), 2U);
  EXPECT_EQ(back.frames[1].frame, 4);
  EXPECT_NEAR(back.frames[0].motion, 0.5, 0.05);
  EXPECT_EQ(back.findings.size(), record_.findings.size());
  EXPECT_EQ(back.families.size(), 14U);
  EXPECT_EQ(back.sections.size(), 2U);
}

TEST_F(Records, ASpoiltFileIsRefusedWithWhatIsWrong) {
  auto json = nlohmann::ordered_json::parse(to_json(record_));
  const auto refusal = [](const nlohmann::ordered_json& spoilt) {
    try {
      reconstruction_record_from_json(spoilt.dump(), "gel.json");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  auto spoilt = json;
  spoilt["format_version"] = 2;
  EXPECT_THAT(refusal(spoilt), HasSubstr("newer"));
  spoilt = json;
  spoilt["frames"][0].erase("lambda");
  EXPECT_THAT(refusal(spoilt), HasSubstr("lambda"));
  spoilt = json;
  spoilt["families"][0]["by_frame"] = {1.0};
  EXPECT_THAT(refusal(spoilt), HasSubstr("family"));
  spoilt = json;
  spoilt["findings"][0]["severity"] = "dire";
  EXPECT_THAT(refusal(spoilt), HasSubstr("dire"));
}

TEST_F(Records, PointsKnowNoMoreThanTheField) {
  ASSERT_EQ(reconstruction_.samples.size(), 2U);
  const auto information = [](const SampledFrame& frame) {
    double sum = 0.0;
    for (const ObservedPoint& point : frame.points)
      sum += 1.0 / (point.sigma_mm * point.sigma_mm);
    return sum;
  };
  const SampledFrame& few = reconstruction_.samples.back();
  const SampledFrame many =
      sample_field(reconstruction_.fields.back(), spread_points(*reconstruction_.forms, 1000));
  EXPECT_GT(many.points.size(), 5 * few.points.size());
  EXPECT_NEAR(information(many) / information(few), 1.0, 0.15);
  for (const ObservedPoint& point : many.points) {
    const double radius_mm = std::hypot(point.X_mm[0], point.X_mm[1]);
    ASSERT_GT(radius_mm, 22.3);
    ASSERT_LT(radius_mm, 50.2);
  }
  const test::ScratchFolder folder;
  const auto file = folder.write("gel.points.csv", points_csv(reconstruction_.samples));
  const std::vector<ObservedPoint> back = read_points(file, 5);
  ASSERT_EQ(back.size(), reconstruction_.samples[0].points.size() + few.points.size());
  EXPECT_EQ(back.back().frame, 4);
  EXPECT_NEAR(back.back().x_mm[0], few.points.back().x_mm[0], 1e-4);
}

TEST_F(Records, TheGridHoldsTheFieldAtItsCorners) {
  const BezierGrid grid = reconstruction_grid(reconstruction_);
  ASSERT_EQ(grid.steps.size(), 2U);
  const HermiteMesh& mesh = reconstruction_.body->mesh;
  EXPECT_EQ(grid.points_mm.size(), mesh.element_count() * 64 * 3);
  const GridArray& displacement = grid.steps[1].point_data[0];
  EXPECT_EQ(displacement.name, "displacement_mm");
  const Eigen::Vector3d expected = mesh.value(reconstruction_.fields[1].displacement_mm, {3, {0, 0, 0}});
  for (size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(displacement.values[3 * 64 * 3 + i], expected[static_cast<Eigen::Index>(i)], 1e-12);
  EXPECT_EQ(grid.cell_data[1].name, "rows");
}

TEST_F(Records, TheReportShowsMapsAndFindings) {
  const test::ScratchFolder folder;
  const std::filesystem::path file = folder.write("gel.json", to_json(record_));
  const std::string page = report::make_report(std::span(&file, 1));
  EXPECT_THAT(page, HasSubstr("Displacement from tagged images"));
  EXPECT_THAT(page, HasSubstr("away from the motion of the others"));
  EXPECT_THAT(page, HasSubstr("unseen share"));
  EXPECT_THAT(page, HasSubstr("cross-validation score"));
  EXPECT_THAT(page, HasSubstr("The worst-covered elements"));
}

}  // namespace
}  // namespace diastole
