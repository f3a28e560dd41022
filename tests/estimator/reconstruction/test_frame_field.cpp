#include "estimator/reconstruction/frame_field.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/fe/gauss_points.hpp"
#include "tests/estimator/reconstruction/tagged_motion.hpp"

namespace diastole {
namespace {

constexpr int last = 4;
constexpr double inner_mm = 5.0;

/// Root mean square over the body of the difference of two fields.
double rms_difference(const HermiteMesh& mesh, const NodeField& a, const NodeField& b) {
  double sum = 0.0;
  size_t count = 0;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (const Xi& xi : gauss_tables().xi) {
      sum += (mesh.value(a, {e, xi}) - mesh.value(b, {e, xi})).squaredNorm();
      ++count;
    }
  }
  return std::sqrt(sum / static_cast<double>(count));
}

class FieldOfAFrame : public testing::Test {
 protected:
  FrameField reconstruct(const test::TaggedOptions& options, const FrameOptions& frame = {}) {
    return reconstruct_frame(forms_, tags(options), last, frame);
  }
  Measurement tags(test::TaggedOptions options) {
    options.frames = {last};
    return test::tagged_inflation(mesh_, inner_mm, options);
  }

  HermiteMesh mesh_ = test::small_gel();
  FieldForms forms_{mesh_, {}};
  NodeField truth_ = test::inflation(mesh_, inner_mm);
};

TEST_F(FieldOfAFrame, ExactTagsGiveTheMotionBack) {
  const FrameField field = reconstruct({.tags_a_frame = 2000, .noise = 0.0}, {.lambda = 1e-4});
  EXPECT_TRUE(field.converged);
  EXPECT_TRUE(field.tags_not_found.empty());
  EXPECT_LT(rms_difference(mesh_, field.displacement_mm, truth_), 2e-3);
}

TEST_F(FieldOfAFrame, ErrorsAreAsLargeAsStated) {
  const FrameField field = reconstruct({.tags_a_frame = 1200});
  EXPECT_TRUE(field.converged);
  EXPECT_FALSE(field.smoothing.at_edge);
  EXPECT_NEAR(field.scale, 1.0, 0.1);
  const double freedom = field.residual_freedom;
  EXPECT_LT(freedom, static_cast<double>(field.used()) - field.degrees_of_freedom);
  EXPECT_NEAR(field.chi2() / freedom, 1.0, 4.0 * std::sqrt(2.0 / freedom));
  EXPECT_LT(rms_difference(mesh_, field.displacement_mm, truth_), 0.36);

  std::vector<Functional> functionals;
  std::vector<double> errors_mm;
  for (size_t e = 0; e < mesh_.element_count(); ++e) {
    for (size_t q = 0; q < gauss_points; q += 5) {
      const MaterialPoint point{e, gauss_tables().xi[q]};
      for (int k = 0; k < 3; ++k) {
        functionals.push_back(displacement_along(mesh_, point, Eigen::Vector3d::Unit(k)));
        errors_mm.push_back((mesh_.value(field.displacement_mm, point) - mesh_.value(truth_, point))[k]);
      }
    }
  }
  const std::vector<double> variances = field.system->variances(functionals);
  double squares = 0.0;
  for (size_t i = 0; i < errors_mm.size(); ++i)
    squares += errors_mm[i] * errors_mm[i] / variances[i];
  // On average over the body, smoothing's bias included; the prior of white roughness makes them cautious.
  EXPECT_GT(squares / static_cast<double>(errors_mm.size()), 0.25);
  EXPECT_LT(squares / static_cast<double>(errors_mm.size()), 1.3);
}

TEST_F(FieldOfAFrame, CrossValidationFindsAboutTheBestSmoothing) {
  const double found = rms_difference(mesh_, reconstruct({.tags_a_frame = 800}).displacement_mm, truth_);
  for (const double lambda : {1e2, 1e3, 1e6, 1e7}) {
    const FrameField field = reconstruct({.tags_a_frame = 800}, {.lambda = lambda});
    EXPECT_LT(found, rms_difference(mesh_, field.displacement_mm, truth_)) << lambda;
  }
}

TEST_F(FieldOfAFrame, WildPointsAreFoundAndLeaveTheFieldAlone) {
  const FrameField clean = reconstruct({.tags_a_frame = 1200});
  const FrameField spoilt = reconstruct({.tags_a_frame = 1200, .wild_share = 0.05});
  const auto rejected = static_cast<double>(spoilt.rows.size() - spoilt.used());
  EXPECT_EQ(clean.used(), clean.rows.size());
  EXPECT_GT(rejected + static_cast<double>(spoilt.tags_not_found.size()), 0.035 * 1200);
  EXPECT_LT(rejected, 0.065 * 1200);
  EXPECT_LT(rms_difference(mesh_, spoilt.displacement_mm, truth_), 0.36);
  EXPECT_NEAR(spoilt.scale, 1.0, 0.12);
  const FrameField plain =
      reconstruct({.tags_a_frame = 1200, .wild_share = 0.05}, {.lambda = {}, .robust = false});
  EXPECT_GT(rms_difference(mesh_, plain.displacement_mm, truth_),
            1.5 * rms_difference(mesh_, spoilt.displacement_mm, truth_));
}

TEST_F(FieldOfAFrame, AWrongSigmaDoesNotMakePointsWild) {
  const FrameField field = reconstruct({.tags_a_frame = 1200, .sigma_mm = 0.03, .noise = 10.0});
  EXPECT_EQ(field.used(), field.rows.size());
  EXPECT_NEAR(field.scale, 10.0, 1.2);
}

TEST_F(FieldOfAFrame, PointsGiveTheSameMotionAsTags) {
  Measurement measurement = tags({.tags_a_frame = 1200});
  const PointLocator locator(mesh_, mesh_.reference());
  for (const TagPoint& tag : measurement.tags) {
    const auto found = locator.find(Eigen::Vector3d(tag.x_mm.data()));
    if (tag.frame != last || !found) continue;
    const Eigen::Vector3d X = mesh_.value(mesh_.reference(), found->point);
    const Eigen::Vector3d x = X + mesh_.value(truth_, found->point);
    measurement.points.push_back({last, {X[0], X[1], X[2]}, {x[0], x[1], x[2]}, 0.01});
  }
  measurement.tags.clear();
  const FrameField field = reconstruct_frame(forms_, measurement, last, {});
  EXPECT_TRUE(field.converged);
  EXPECT_LT(rms_difference(mesh_, field.displacement_mm, truth_), 0.01);
}

}  // namespace
}  // namespace diastole
