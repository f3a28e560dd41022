#include <gmock/gmock.h>

#include "estimator/mesh/local_field.hpp"
#include "estimator/motion_residuals/tag_match.hpp"
#include "tests/estimator/fit/synthetic.hpp"
#include "tests/estimator/motion_residuals/mapped_field.hpp"

namespace diastole {
namespace {

using test::mapped;

class TagOnSheared : public testing::Test {
 protected:
  TagOnSheared() : model_(test::coarse_gel(8)), reference_(model_.mesh(), model_.mesh().reference()) {
    shear_ << 1.05, 0.08, 0.02, -0.03, 0.97, 0.05, 0.01, -0.06, 0.98;
    position_mm_ = mapped(model_.mesh().reference(), shear_);
  }

  /// A tag whose true material point is X, seen `error_mm` too far along its normal.
  TagPoint tag(const Eigen::Vector3d& X_mm, const Eigen::Vector3d& normal, double error_mm) const {
    const Eigen::Vector3d seen = shear_ * X_mm + error_mm * normal;
    return {1, {normal[0], normal[1], normal[2]}, normal.dot(X_mm), {seen[0], seen[1], seen[2]}, 0.8};
  }

  std::optional<TagMatch> match(const TagPoint& tag, const NodeField& position_mm,
                                const MaterialPoint& guess = {0, {0.5, 0.5, 0.5}}) const {
    return match_tag(reference_, element_fields(model_.mesh(), position_mm), tag, guess);
  }

  ElasticModel model_;
  PointLocator reference_;
  Eigen::Matrix3d shear_;
  NodeField position_mm_;
};

TEST_F(TagOnSheared, TheErrorAlongTheNormalIsFoundExactly) {
  const Eigen::Vector3d normal(std::sqrt(0.5), std::sqrt(0.5), 0);
  for (const double error_mm : {0.0, 0.7, -2.4}) {
    const auto found = match(tag({30, 5, 10}, normal, error_mm), position_mm_);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->error_mm, error_mm, 1e-8);
  }
}

TEST_F(TagOnSheared, TheSearchCrossesElementsAndLeavesTheBodyALittle) {
  const Eigen::Vector3d normal(std::sqrt(0.5), 0, std::sqrt(0.5));
  struct Case {
    Eigen::Vector3d X_mm, guess_mm;
  };
  // Into the next element around and below, and material just inside a wall that is seen outside it.
  for (const Case& c : {Case{{-5, 38, -12}, {8, 36, 8}}, Case{{0.5, 49.95, 0}, {0.5, 45, 0}},
                        Case{{22.52, 0.5, 15}, {25, 0.5, 15}}}) {
    const MaterialPoint guess = reference_.find(c.guess_mm).value().point;
    for (const double error_mm : {1.5, -1.5}) {
      const auto found = match(tag(c.X_mm, normal, error_mm), position_mm_, guess);
      ASSERT_TRUE(found) << c.X_mm.transpose();
      EXPECT_NEAR(found->error_mm, error_mm, 1e-8) << c.X_mm.transpose();
    }
  }
}

TEST_F(TagOnSheared, TheDerivativeIsThatOfTheFoundError) {
  const TagPoint seen = tag({-28, 17, 8}, {0, std::sqrt(0.5), -std::sqrt(0.5)}, 0.9);
  const auto found = match(seen, position_mm_);
  ASSERT_TRUE(found);
  Eigen::Matrix3d direction;
  direction << 0.3, -0.2, 0.1, 0.5, 0.4, -0.3, 0.2, 0.1, -0.6;
  const double h = 1e-5;
  const auto ahead = match(seen, mapped(model_.mesh().reference(), shear_ + h * direction));
  const auto behind = match(seen, mapped(model_.mesh().reference(), shear_ - h * direction));
  ASSERT_TRUE(ahead && behind);
  const Eigen::Vector3d du = direction * model_.mesh().value(model_.mesh().reference(), found->point);
  EXPECT_NEAR(found->by_motion.dot(du), (ahead->error_mm - behind->error_mm) / (2 * h), 1e-6);
}

TEST_F(TagOnSheared, APointFarFromTheBodyIsNotFound) {
  EXPECT_FALSE(match(tag({120, 0, 0}, {1, 0, 0}, 0), position_mm_));
}

}  // namespace
}  // namespace diastole
