#include "estimator/mesh/bezier.hpp"

namespace diastole {
namespace {

/// Control values i (row) of the four Hermite functions a (column) of one direction.
constexpr std::array<std::array<double, 4>, 4> control_of_hermite{
    {{1.0, 0.0, 0.0, 0.0}, {1.0, 1.0 / 3.0, 0.0, 0.0}, {0.0, 0.0, 1.0, -1.0 / 3.0}, {0.0, 0.0, 1.0, 0.0}}};

Eigen::Matrix4d bernstein_at(const std::array<double, 4>& at) {
  Eigen::Matrix4d basis;
  for (Eigen::Index q = 0; q < 4; ++q) {
    const double xi = at[static_cast<size_t>(q)];
    const double rest = 1.0 - xi;
    basis.row(q) << rest * rest * rest, 3.0 * xi * rest * rest, 3.0 * xi * xi * rest, xi * xi * xi;
  }
  return basis;
}

}  // namespace

BezierField bezier_of(const ElementField& hermite) {
  BezierField control = BezierField::Zero();
  for (size_t i = 0; i < bezier_points; ++i) {
    for (size_t a = 0; a < hermite_functions; ++a) {
      double factor = 1.0;
      for (size_t k = 0; k < 3; ++k)
        factor *= control_of_hermite[(i >> (2 * k)) & 3][(a >> (2 * k)) & 3];
      if (factor != 0.0)
        control.col(static_cast<Eigen::Index>(i)) += factor * hermite.col(static_cast<Eigen::Index>(a));
    }
  }
  return control;
}

Eigen::MatrixXd bezier_through(const std::array<double, 4>& at,
                               const std::function<Eigen::VectorXd(const Xi&)>& sample) {
  Eigen::MatrixXd result;
  for (size_t q = 0; q < bezier_points; ++q) {
    const Eigen::VectorXd numbers = sample({at[q & 3], at[(q >> 2) & 3], at[q >> 4]});
    if (q == 0) result.resize(bezier_points, numbers.size());
    result.row(static_cast<Eigen::Index>(q)) = numbers;
  }
  const Eigen::Matrix4d inverse = bernstein_at(at).inverse();
  for (size_t k = 0; k < 3; ++k) {
    const Eigen::MatrixXd before = result;
    const size_t stride = size_t{1} << (2 * k);
    for (size_t i = 0; i < bezier_points; ++i) {
      const size_t digit = (i / stride) & 3;
      const size_t first = i - digit * stride;
      result.row(static_cast<Eigen::Index>(i)).setZero();
      for (size_t q = 0; q < 4; ++q) {
        result.row(static_cast<Eigen::Index>(i)) +=
            inverse(static_cast<Eigen::Index>(digit), static_cast<Eigen::Index>(q)) *
            before.row(static_cast<Eigen::Index>(first + q * stride));
      }
    }
  }
  return result;
}

size_t vtk_place_of(size_t i1, size_t i2, size_t i3) {
  constexpr size_t degree = 3;
  constexpr size_t inner = degree - 1;
  const std::array<size_t, 3> i{i1, i2, i3};
  const auto ends = [](size_t index) { return index == 0 || index == degree; };
  const auto far = [&](size_t k) { return i[k] != 0 ? size_t{1} : size_t{0}; };
  const size_t corner = i1 != 0 ? (i2 != 0 ? 2 : 1) : (i2 != 0 ? 3 : 0);  // anticlockwise around xi3
  const int boundaries = ends(i1) + ends(i2) + ends(i3);
  if (boundaries == 3) return corner + 4 * far(2);
  size_t offset = 8;
  if (boundaries == 2) {
    if (!ends(i1)) return offset + i1 - 1 + far(1) * 2 * inner + far(2) * 4 * inner;
    if (!ends(i2)) return offset + i2 - 1 + (i1 != 0 ? inner : 3 * inner) + far(2) * 4 * inner;
    return offset + 8 * inner + i3 - 1 + corner * inner;
  }
  offset += 12 * inner;
  if (boundaries == 1) {
    const size_t normal = ends(i1) ? 0 : ends(i2) ? 1 : 2;
    const size_t first = normal == 0 ? i2 : i1;
    const size_t second = normal == 2 ? i2 : i3;
    return offset + (2 * normal + far(normal)) * inner * inner + first - 1 + inner * (second - 1);
  }
  return offset + 6 * inner * inner + i1 - 1 + inner * (i2 - 1 + inner * (i3 - 1));
}

void append_in_vtk_order(const Eigen::MatrixXd& control, std::vector<double>& values) {
  const auto width = static_cast<size_t>(control.cols());
  const size_t start = values.size();
  values.resize(start + bezier_points * width);
  for (size_t i = 0; i < bezier_points; ++i) {
    const size_t row = start + width * vtk_place_of(i & 3, (i >> 2) & 3, i >> 4);
    for (size_t j = 0; j < width; ++j)
      values[row + j] = control(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  }
}

}  // namespace diastole
