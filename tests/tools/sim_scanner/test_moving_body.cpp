#include "tools/sim_scanner/moving_body.hpp"

#include <gtest/gtest.h>

#include "estimator/mesh/annulus.hpp"
#include "estimator/mesh/ellipsoid.hpp"

namespace diastole::scanner {
namespace {

/// A slice along z through a body at rest.
struct LongSlice {
  ScanPlane plane;
  SliceOfBody body;
  static constexpr double extent_mm = 150;

  explicit LongSlice(const HermiteMesh& mesh)
      : plane{{-75, 0, 75}, Eigen::Vector3d::UnitX(), -Eigen::Vector3d::UnitZ(), "LA000"},
        body(mesh, mesh.reference(), plane, extent_mm, 4) {}
  [[nodiscard]] Spot at(double x_mm, double z_mm) const { return body.at({x_mm + 75, 75 - z_mm, 0.7}); }
};

TEST(SliceOfBody, TissueReachesTheEndsAndIsThereWhatItWas) {
  AnnulusShape shape;
  shape.elements = {8, 4, 1};
  const LongSlice slice(make_annulus(shape));
  const double end_mm = 0.5 * shape.height_mm;
  for (const double beside_mm : {0.05, 0.4, 1.1, 2.3}) {
    for (const double side : {-1.0, 1.0}) {
      const Spot spot = slice.at(30, side * (end_mm - beside_mm));
      ASSERT_EQ(spot.medium, Medium::tissue) << beside_mm << " mm from the end";
      EXPECT_NEAR(spot.X_mm.x(), 30, 0.01) << beside_mm << " mm from the end";
      EXPECT_NEAR(spot.X_mm.z(), side * (end_mm - beside_mm), 0.01);
      EXPECT_EQ(slice.at(30, side * (end_mm + beside_mm)).medium, Medium::nothing);
      EXPECT_EQ(slice.at(5, side * (end_mm + beside_mm)).medium, Medium::nothing);
      EXPECT_EQ(slice.at(5, side * (end_mm - beside_mm)).medium, Medium::cavity);
    }
  }
}

TEST(SliceOfBody, AVentriclesWallReachesItsBase) {
  const EllipsoidShape shape;
  const LongSlice slice(make_ellipsoid(shape));
  for (const double beside_mm : {0.05, 0.5, 1.5}) {
    EXPECT_EQ(slice.at(25, shape.base_z_mm - beside_mm).medium, Medium::tissue);
    EXPECT_EQ(slice.at(25, shape.base_z_mm + beside_mm).medium, Medium::nothing);
    EXPECT_EQ(slice.at(5, shape.base_z_mm - beside_mm).medium, Medium::cavity);
    EXPECT_EQ(slice.at(35, shape.base_z_mm - beside_mm).medium, Medium::bath);
  }
}

}  // namespace
}  // namespace diastole::scanner
