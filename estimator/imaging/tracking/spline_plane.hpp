#pragma once
// Smooth functions over a slice: bicubic B-splines on a square grid of knots, and how rough they are.

#include <Eigen/Dense>
#include <array>
#include <optional>
#include <vector>

namespace diastole::imaging {

/// The 16 splines that are not zero at a point, four across by four down.
struct SplineValues {
  std::array<int, 16> index;  ///< -1 for a spline that is left out
  std::array<double, 4> across;
  std::array<double, 4> down;

  [[nodiscard]] double value(size_t i) const { return across[i % 4] * down[i / 4]; }
};
double spline_sum(const SplineValues& splines, const Eigen::Ref<const Eigen::VectorXd>& coefficients);

/// w(x) = sum of coefficient i times spline i; x in mm within the slice. Splines that no sample touches are left out.
class SplinePlane {
 public:
  /// Covers the samples (2 x n, mm) with knots `spacing_mm` apart.
  SplinePlane(const Eigen::Matrix2Xd& samples_mm, double spacing_mm);

  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] SplineValues at(const Eigen::Vector2d& x_mm) const;
  [[nodiscard]] double value(const Eigen::Ref<const Eigen::VectorXd>& coefficients,
                             const Eigen::Vector2d& x_mm) const;

  /// The precision of a Whittle-Matern field of the range sqrt(8) / kappa (Lindgren, Rue, Lindstrom, J. R. Stat. Soc. B 73 (2011)
  /// 423) on the grid of coefficients: R = (kappa^2 h^2 + L)^2 with the grid's graph Laplacian L, which leaves the border free, scaled so
  /// that the variance of w is 1 on average.
  [[nodiscard]] Eigen::MatrixXd precision(double kappa_per_mm) const;

 private:
  [[nodiscard]] int number(int column, int row) const;
  /// The splines of a cell; nothing if one of them is left out.
  [[nodiscard]] std::optional<std::array<int, 16>> cell(int column, int row) const;
  template <class Visit>
  void each_cell(const Visit& visit) const {
    for (int row = 0; row + 3 < rows_; ++row) {
      for (int column = 0; column + 3 < columns_; ++column) {
        if (const auto index = cell(column, row)) visit(*index);
      }
    }
  }

  Eigen::Vector2d first_mm_;
  double spacing_mm_;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<int> numbers_;  // of the grid's splines; -1: left out
  int count_ = 0;
};

}  // namespace diastole::imaging
