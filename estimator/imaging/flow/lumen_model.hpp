#pragma once
// The image that a scanner makes of fluid in a lumen, its wall, and still material around: a model for partial volume at the edge.
//
//                 outside: still material, brightness `still`
//        .-----------------------.    as the edge, larger by wall / radius
//       /  wall: little signal    \ .
//      |   .-------------------.   |  edge: radius / sqrt(1 - 2 e_c cos 2 theta - 2 e_s sin 2 theta), an ellipse
//      |  |  depth d inwards   |   |  velocity sum_j c_j B_j(d), zero at the edge; d = radius (1 - r / edge)
//
// A pixel's complex signal is the object's spectrum cut to the acquired matrix: with x' in mm over a fine grid,
//   z(x) = sum over x' of rho(x') exp(i k phi(x')) share sinc(share (x - x') / spacing)
// rho is the brightness, phi = pi v / venc. An image that encodes velocity (k = 1) is compared with one that does not (k = 0), or two that encode half of it to either side (k = +-1/2):
// phase = arg z_1 - arg z_0, magnitude = the mean of the two. So fast and slow fluid, and fluid and wall, mix as they do in a scanner. Fluid that flows in is brighter: rho = a + b |phi| + c phi^2.

#include <Eigen/Dense>
#include <vector>

#include "estimator/imaging/dicom/slice_plane.hpp"

namespace diastole::imaging {

struct LumenShape {
  Eigen::Vector2d centre_mm = {0, 0};  ///< along a row and along a column from the first pixel's centre
  double radius_mm = 0;
  double ellipse_cos = 0, ellipse_sin = 0;
  double wall_mm = 0;

  /// From the centre along a unit vector.
  [[nodiscard]] double edge_mm(const Eigen::Vector2d& towards) const;
  /// d(ln edge)/d(angle) there.
  [[nodiscard]] double slant(const Eigen::Vector2d& towards) const;

 private:
  [[nodiscard]] double longer(const Eigen::Vector2d& towards) const;
};

struct Brightness {
  double still = 0;
  Eigen::Vector2d slope_per_mm = {0, 0};  ///< of the coils' shading, relative
  Eigen::Vector3d fluid = {0, 0, 0};      ///< a, b, c
  double wall = 0;
};

enum class Encoding { separate, balanced };

/// The unknowns that all phases of the cycle share, as one vector: shape, then brightness.
struct LumenScene {
  static constexpr Eigen::Index shape_size = 6;
  static constexpr Eigen::Index size = 13;
  LumenShape shape;
  Brightness brightness;

  [[nodiscard]] Eigen::VectorXd vector() const;
  static LumenScene from(const Eigen::VectorXd& vector);
};

/// Where velocity profiles may bend: values of a natural cubic spline of the depth at these, zero at the edge and level in the middle; then two tilts across the
/// lumen, along a row and along a column.
std::vector<double> profile_knots_mm(double radius_mm, double pixel_mm);

/// A scene on the fine grid.
struct LumenGrid {
  Eigen::MatrixXf inside;              ///< share of a fine cell that is lumen
  Eigen::MatrixXf outside;             ///< that is still material
  std::vector<Eigen::MatrixXf> basis;  ///< B_j
};

struct LumenImage {
  Eigen::ArrayXXd phase_rad;
  Eigen::ArrayXXd magnitude;
};

class LumenModel {
 public:
  /// A window of the slice around a lumen of about that shape, which goes up to `movement_mm` away along a row and along a column.
  /// `measured_share`: of the spectrum's lines, along rows and along columns.
  LumenModel(const SlicePlane& plane, const LumenShape& about, const Eigen::Vector2d& measured_share,
             const Eigen::Vector2d& movement_mm = {0, 0});

  [[nodiscard]] int first_column() const { return first_column_; }
  [[nodiscard]] int first_row() const { return first_row_; }
  [[nodiscard]] Eigen::Index columns() const { return along_row_.rows(); }
  [[nodiscard]] Eigen::Index rows() const { return along_column_.rows(); }
  [[nodiscard]] Eigen::Index profile_size() const { return static_cast<Eigen::Index>(knots_mm_.size()) + 2; }

  /// A core with a boundary layer of that width, exponential; 0: none.
  [[nodiscard]] Eigen::VectorXd layer_profile(double core, double layer_mm) const;
  [[nodiscard]] LumenGrid grid(const LumenShape& shape) const;
  /// Its derivatives by the profile's coefficients are appended if `slopes` is given.
  [[nodiscard]] LumenImage image(const LumenGrid& grid, const Brightness& brightness, Encoding encoding,
                                 const Eigen::VectorXd& profile,
                                 std::vector<LumenImage>* slopes = nullptr) const;
  /// Integral of each profile function over the lumen, mm^2.
  [[nodiscard]] Eigen::VectorXd integrals_mm2(const LumenGrid& grid) const;
  [[nodiscard]] double area_mm2(const LumenGrid& grid) const;

 private:
  [[nodiscard]] Eigen::MatrixXf seen(const Eigen::MatrixXf& fine) const;
  [[nodiscard]] double shading(const Brightness& brightness, Eigen::Index row, Eigen::Index column) const;

  Eigen::Vector2d spacing_mm_;  // between columns, between rows
  int first_column_ = 0, first_row_ = 0;
  Eigen::VectorXd fine_x_mm_, fine_y_mm_;
  Eigen::MatrixXf along_row_, along_column_;  // from the fine grid to pixels
  std::vector<double> knots_mm_;
  Eigen::Vector2d middle_mm_;
};

}  // namespace diastole::imaging
