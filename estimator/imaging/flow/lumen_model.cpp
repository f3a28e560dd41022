#include "estimator/imaging/flow/lumen_model.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace diastole::imaging {
namespace {

/// Fine cells a pixel: an edge's area is then right to a thousandth of the lumen's.
constexpr int cells_a_pixel = 5;
/// Pixels beyond the edge that are compared: where its ringing has fallen to a hundredth.
constexpr double margin_px = 4;
/// Of an ellipse's edge, as one over its square: twelve times as long as wide.
constexpr double least_square = 0.01;

double sinc(double x) {
  const double angle = std::numbers::pi * x;
  return std::abs(angle) < 1e-9 ? 1.0 : std::sin(angle) / angle;
}

/// Natural cubic spline through 0 at the edge and values at the knots, level at the last: row j of the result is the function that is 1 at knot j.
class ProfileSpline {
 public:
  explicit ProfileSpline(const std::vector<double>& knots) : at_(knots) {
    at_.insert(at_.begin(), 0.0);
    const auto n = static_cast<Eigen::Index>(at_.size());
    Eigen::MatrixXd bend = Eigen::MatrixXd::Zero(n, n), slope = Eigen::MatrixXd::Zero(n, n);
    const auto step = [&](Eigen::Index i) {
      return at_[static_cast<size_t>(i) + 1] - at_[static_cast<size_t>(i)];
    };
    bend(0, 0) = 1;
    for (Eigen::Index i = 1; i + 1 < n; ++i) {
      bend(i, i - 1) = step(i - 1);
      bend(i, i) = 2 * (step(i - 1) + step(i));
      bend(i, i + 1) = step(i);
      slope(i, i - 1) = 6 / step(i - 1);
      slope(i, i) = -6 / step(i - 1) - 6 / step(i);
      slope(i, i + 1) = 6 / step(i);
    }
    bend(n - 1, n - 1) = 2 * step(n - 2);
    bend(n - 1, n - 2) = step(n - 2);
    slope(n - 1, n - 1) = -6 / step(n - 2);
    slope(n - 1, n - 2) = 6 / step(n - 2);
    second_ = bend.partialPivLu().solve(slope);
  }

  void values(double depth, Eigen::VectorXf& result) const {
    depth = std::clamp(depth, 0.0, at_.back());
    const auto above = std::upper_bound(at_.begin() + 1, at_.end() - 1, depth);
    const auto i = static_cast<Eigen::Index>(above - at_.begin()) - 1;
    const double h = at_[static_cast<size_t>(i) + 1] - at_[static_cast<size_t>(i)];
    const double a = (at_[static_cast<size_t>(i) + 1] - depth) / h;
    const double b = 1 - a;
    for (Eigen::Index j = 0; j < result.size(); ++j)
      result[j] = static_cast<float>(
          (j + 1 == i ? a : 0.0) + (j == i ? b : 0.0) +
          ((a * a * a - a) * second_(i, j + 1) + (b * b * b - b) * second_(i + 1, j + 1)) * h * h / 6);
  }

 private:
  std::vector<double> at_;
  Eigen::MatrixXd second_;  // second derivatives at the knots by the values there
};

struct CosineAndSine {
  double cosine, sine;
};

/// Of twice the angle of a unit vector.
CosineAndSine doubled(const Eigen::Vector2d& unit) {
  return {unit.x() * unit.x() - unit.y() * unit.y(), 2 * unit.x() * unit.y()};
}

struct Signal {
  Eigen::MatrixXf real, imaginary;
};

}  // namespace

double LumenShape::edge_mm(const Eigen::Vector2d& towards) const {
  return radius_mm / std::sqrt(std::max(least_square, 1 - 2 * longer(towards)));
}

double LumenShape::slant(const Eigen::Vector2d& towards) const {
  const auto [cosine, sine] = doubled(towards);
  return 2 * (ellipse_sin * cosine - ellipse_cos * sine) / std::max(least_square, 1 - 2 * longer(towards));
}

double LumenShape::longer(const Eigen::Vector2d& towards) const {
  const auto [cosine, sine] = doubled(towards);
  return ellipse_cos * cosine + ellipse_sin * sine;
}

Eigen::VectorXd LumenScene::vector() const {
  Eigen::VectorXd all(size);
  all << shape.centre_mm, shape.radius_mm, shape.ellipse_cos, shape.ellipse_sin, shape.wall_mm,
      brightness.still, brightness.slope_per_mm, brightness.fluid, brightness.wall;
  return all;
}

LumenScene LumenScene::from(const Eigen::VectorXd& vector) {
  return {{vector.head<2>(), vector[2], vector[3], vector[4], vector[5]},
          {vector[6], vector.segment<2>(7), vector.segment<3>(9), vector[12]}};
}

std::vector<double> profile_knots_mm(double radius_mm, double pixel_mm) {
  // Half pixels at the edge, where the velocity rises over a pixel or two, then ever wider.
  std::vector<double> knots;
  const double last = 0.9 * radius_mm;
  for (double depth_px = 0.5, step = 0.5; depth_px * pixel_mm < last - 0.5 * step * pixel_mm;
       depth_px += step) {
    knots.push_back(depth_px * pixel_mm);
    if (depth_px > 1.2) step *= 1.4;
  }
  knots.push_back(last);
  return knots;
}

LumenModel::LumenModel(const SlicePlane& plane, const LumenShape& about,
                       const Eigen::Vector2d& measured_share, const Eigen::Vector2d& movement_mm)
    : spacing_mm_(plane.column_spacing_mm, plane.row_spacing_mm),
      knots_mm_(profile_knots_mm(about.radius_mm, plane.finer_spacing_mm())),
      middle_mm_(about.centre_mm) {
  // Room for a tube that is cut at 45 degrees.
  const double stretch = 1.2 + std::hypot(about.ellipse_cos, about.ellipse_sin);
  const auto prepare = [&](double centre_mm, double spacing_mm, double moves_mm, int count, double share,
                           int& first, Eigen::VectorXd& fine_mm, Eigen::MatrixXf& kernel) {
    const double reach_mm = about.radius_mm * stretch + moves_mm + margin_px * spacing_mm;
    first = std::max(0, static_cast<int>(std::floor((centre_mm - reach_mm) / spacing_mm)));
    const int last = std::min(count - 1, static_cast<int>(std::ceil((centre_mm + reach_mm) / spacing_mm)));
    const double object_mm = (about.radius_mm + about.wall_mm) * stretch + moves_mm + 2 * spacing_mm;
    const auto fine = static_cast<Eigen::Index>(std::ceil(2 * object_mm / spacing_mm)) * cells_a_pixel;
    const double step_mm = spacing_mm / cells_a_pixel;
    const double start_mm = centre_mm - 0.5 * step_mm * static_cast<double>(fine - 1);
    fine_mm = Eigen::VectorXd::LinSpaced(fine, start_mm, start_mm + step_mm * static_cast<double>(fine - 1));
    kernel.resize(std::max(1, last - first + 1), fine);
    for (Eigen::Index pixel = 0; pixel < kernel.rows(); ++pixel)
      for (Eigen::Index cell = 0; cell < fine; ++cell)
        kernel(pixel, cell) = static_cast<float>(
            share * sinc(share * (static_cast<double>(first + pixel) - fine_mm[cell] / spacing_mm)) /
            cells_a_pixel);
  };
  prepare(about.centre_mm.x(), spacing_mm_.x(), movement_mm.x(), plane.columns, measured_share.x(),
          first_column_, fine_x_mm_, along_row_);
  prepare(about.centre_mm.y(), spacing_mm_.y(), movement_mm.y(), plane.rows, measured_share.y(), first_row_,
          fine_y_mm_, along_column_);
}

Eigen::VectorXd LumenModel::layer_profile(double core, double layer_mm) const {
  Eigen::VectorXd profile = Eigen::VectorXd::Zero(profile_size());
  for (size_t j = 0; j < knots_mm_.size(); ++j)
    profile[static_cast<Eigen::Index>(j)] =
        core * (layer_mm > 0 ? 1 - std::exp(-knots_mm_[j] / layer_mm) : 1.0);
  return profile;
}

LumenGrid LumenModel::grid(const LumenShape& shape) const {
  const Eigen::Index rows = fine_y_mm_.size(), columns = fine_x_mm_.size();
  const auto knots = static_cast<Eigen::Index>(knots_mm_.size());
  LumenGrid grid;
  grid.inside = grid.outside = Eigen::MatrixXf::Zero(rows, columns);
  grid.basis.assign(static_cast<size_t>(profile_size()), Eigen::MatrixXf::Zero(rows, columns));
  const ProfileSpline spline(knots_mm_);
  const double cell_mm = std::sqrt(spacing_mm_.prod()) / cells_a_pixel;
  Eigen::VectorXf values(knots);
  for (Eigen::Index column = 0; column < columns; ++column) {
    for (Eigen::Index row = 0; row < rows; ++row) {
      const Eigen::Vector2d from(fine_x_mm_[column] - shape.centre_mm.x(),
                                 fine_y_mm_[row] - shape.centre_mm.y());
      const double radius = from.norm();
      const Eigen::Vector2d towards = radius > 0 ? Eigen::Vector2d(from / radius) : Eigen::Vector2d::UnitX();
      const double edge = shape.edge_mm(towards), slant = shape.slant(towards);
      // The edge's slant against the circle shortens the way to it.
      const double depth = (edge - radius) / std::sqrt(1 + slant * slant);
      const double inside = std::clamp(depth / cell_mm + 0.5, 0.0, 1.0);
      grid.outside(row, column) = static_cast<float>(
          std::clamp((radius - edge * (1 + shape.wall_mm / shape.radius_mm)) / cell_mm + 0.5, 0.0, 1.0));
      if (inside <= 0) continue;
      grid.inside(row, column) = static_cast<float>(inside);
      // The layers of a round tube that is cut slantwise are ellipses of one shape.
      const double layer = shape.radius_mm * (1 - radius / edge);
      spline.values(layer, values);
      for (Eigen::Index j = 0; j < knots; ++j)
        grid.basis[static_cast<size_t>(j)](row, column) = values[j];
      const double rise = std::clamp(layer / knots_mm_[std::min<size_t>(2, knots_mm_.size() - 1)], 0.0, 1.0);
      for (Eigen::Index axis = 0; axis < 2; ++axis)
        grid.basis[static_cast<size_t>(knots + axis)](row, column) =
            static_cast<float>(rise * from[axis] / shape.radius_mm);
    }
  }
  return grid;
}

Eigen::MatrixXf LumenModel::seen(const Eigen::MatrixXf& fine) const {
  return along_column_ * (fine * along_row_.transpose());
}

double LumenModel::shading(const Brightness& brightness, Eigen::Index row, Eigen::Index column) const {
  const Eigen::Vector2d at(static_cast<double>(first_column_ + column) * spacing_mm_.x(),
                           static_cast<double>(first_row_ + row) * spacing_mm_.y());
  return 1 + brightness.slope_per_mm.dot(at - middle_mm_);
}

LumenImage LumenModel::image(const LumenGrid& grid, const Brightness& brightness, Encoding encoding,
                             const Eigen::VectorXd& profile, std::vector<LumenImage>* slopes) const {
  const float share = encoding == Encoding::separate ? 1.0F : 0.5F;
  Eigen::ArrayXXf phi = Eigen::ArrayXXf::Zero(grid.inside.rows(), grid.inside.cols());
  for (size_t j = 0; j < grid.basis.size(); ++j)
    phi += static_cast<float>(profile[static_cast<Eigen::Index>(j)]) * grid.basis[j].array();
  const Eigen::Array3f fluid = brightness.fluid.cast<float>();
  const auto still = static_cast<float>(brightness.still);
  const Eigen::ArrayXXf inside = grid.inside.array();
  const Eigen::ArrayXXf rho = inside * (fluid[0] + fluid[1] * phi.abs() + fluid[2] * phi.square());
  const Eigen::ArrayXXf cosine = (share * phi).cos(), sine = (share * phi).sin();
  // What differs from still material all over: it ends within the grid.
  const Eigen::ArrayXXf beyond = grid.outside.array() - 1.0F;
  const Eigen::ArrayXXf rest =
      still * beyond - static_cast<float>(brightness.wall) * (beyond + inside).min(0.0F);
  const auto level = [&](const Eigen::ArrayXXf& fine) {
    return Eigen::MatrixXf((seen(fine.matrix()).array() + still).matrix());
  };
  const Signal moved{level(rho * cosine + rest), seen((rho * sine).matrix())};
  const Eigen::MatrixXf fixed = encoding == Encoding::separate ? level(rho + rest) : Eigen::MatrixXf();
  LumenImage image{Eigen::ArrayXXd(rows(), columns()), Eigen::ArrayXXd(rows(), columns())};
  const auto complex_at = [&](const Signal& signal, Eigen::Index i) {
    return std::complex<double>(static_cast<double>(signal.real.data()[i]),
                                static_cast<double>(signal.imaginary.data()[i]));
  };
  for (Eigen::Index column = 0; column < columns(); ++column) {
    for (Eigen::Index row = 0; row < rows(); ++row) {
      const Eigen::Index i = row + column * rows();
      const std::complex<double> z = complex_at(moved, i);
      const double shade = shading(brightness, row, column);
      if (encoding == Encoding::separate) {
        const auto reference = static_cast<double>(fixed.data()[i]);
        image.phase_rad(row, column) = std::arg(z * (reference < 0 ? -1.0 : 1.0));
        image.magnitude(row, column) = 0.5 * shade * (std::abs(z) + std::abs(reference));
      } else {
        image.phase_rad(row, column) = 2 * std::arg(z);
        image.magnitude(row, column) = shade * std::abs(z);
      }
    }
  }
  if (slopes == nullptr) return image;
  const Eigen::ArrayXXf rho_slope = inside * (fluid[1] * phi.sign() + 2.0F * fluid[2] * phi);
  const Eigen::ArrayXXf real_slope = rho_slope * cosine - share * rho * sine;
  const Eigen::ArrayXXf imaginary_slope = rho_slope * sine + share * rho * cosine;
  for (const Eigen::MatrixXf& function : grid.basis) {
    const Signal change{seen((real_slope * function.array()).matrix()),
                        seen((imaginary_slope * function.array()).matrix())};
    const Eigen::MatrixXf fixed_change =
        encoding == Encoding::separate ? seen((rho_slope * function.array()).matrix()) : Eigen::MatrixXf();
    LumenImage slope{Eigen::ArrayXXd(rows(), columns()), Eigen::ArrayXXd(rows(), columns())};
    for (Eigen::Index i = 0; i < slope.phase_rad.size(); ++i) {
      const std::complex<double> z = complex_at(moved, i);
      const std::complex<double> turned =
          std::conj(z) * complex_at(change, i) / std::max(std::norm(z), 1e-12);
      const double shade = shading(brightness, i % rows(), i / rows());
      if (encoding == Encoding::separate) {
        const double sign = fixed.data()[i] < 0.0F ? -1.0 : 1.0;
        slope.phase_rad.data()[i] = turned.imag();
        slope.magnitude.data()[i] =
            0.5 * shade * (turned.real() * std::abs(z) + sign * static_cast<double>(fixed_change.data()[i]));
      } else {
        slope.phase_rad.data()[i] = 2 * turned.imag();
        slope.magnitude.data()[i] = shade * turned.real() * std::abs(z);
      }
    }
    slopes->push_back(std::move(slope));
  }
  return image;
}

Eigen::VectorXd LumenModel::integrals_mm2(const LumenGrid& grid) const {
  const double cell_mm2 = spacing_mm_.prod() / (cells_a_pixel * cells_a_pixel);
  Eigen::VectorXd integrals(profile_size());
  for (size_t j = 0; j < grid.basis.size(); ++j)
    integrals[static_cast<Eigen::Index>(j)] =
        cell_mm2 * static_cast<double>(grid.basis[j].cwiseProduct(grid.inside).cast<double>().sum());
  return integrals;
}

double LumenModel::area_mm2(const LumenGrid& grid) const {
  return spacing_mm_.prod() / (cells_a_pixel * cells_a_pixel) * grid.inside.cast<double>().sum();
}

}  // namespace diastole::imaging
