#include "estimator/imaging/tracking/tag_points.hpp"

#include <cmath>

namespace diastole::imaging {
namespace {

/// Points of one line are this part of the tags' spacing apart: denser ones would repeat what the neighbours say.
constexpr double apart_in_spacings = 0.8;
/// No point nearer to the tissue's edge than the pixel it would be seen in.
constexpr double edge_in_pixels = 0.75;
/// A line is known no better than a twentieth of the spacing: faded, or far from what is seen.
constexpr double most_sigma_in_spacings = 0.05;
/// Residuals of this many times the noise's variance, over a circle of a spacing, are another picture: a ghost, a fold, an edge.
constexpr double most_excess = 3.0;
/// What the residual still wants to move a circle's line by: five standard deviations of it, and a tenth of the spacing.
constexpr double most_pull_in_sigmas = 5.0;
constexpr double most_pull_in_spacings = 0.1;

struct Surroundings {
  double pixels = 0;
  double excess = 0;   // mean squared residual over the noise's variance
  double pull_mm = 0;  // the shift that the residual asks for
  double pull_sigma_mm = 0;
};

class Emitter {
 public:
  Emitter(const TagView& view, const TrackedView& tracked) : view_(view), tracked_(tracked) {}

  TagPoints emit() {
    for (size_t k = 0; k < view_.images.size(); ++k) {
      for (size_t f = 0; f < tracked_.waves.size(); ++f)
        emit_lines(k, f);
    }
    return std::move(points_);
  }

 private:
  double depth_at(size_t k, const Eigen::Vector2d& x_mm) const {
    const double column = x_mm.x() / view_.plane.column_spacing_mm;
    const double row = x_mm.y() / view_.plane.row_spacing_mm;
    const auto c = static_cast<Eigen::Index>(std::floor(column));
    const auto r = static_cast<Eigen::Index>(std::floor(row));
    const Eigen::ArrayXXf& depth = tracked_.phases[k].depth_mm;
    if (c < 0 || r < 0 || c + 1 >= depth.cols() || r + 1 >= depth.rows()) return -1;
    const double u = column - static_cast<double>(c), v = row - static_cast<double>(r);
    return (1 - v) * ((1 - u) * static_cast<double>(depth(r, c)) + u * static_cast<double>(depth(r, c + 1))) +
           v * ((1 - u) * static_cast<double>(depth(r + 1, c)) +
                u * static_cast<double>(depth(r + 1, c + 1)));
  }

  /// Where the line at `along_mm` on the stripes' direction crosses: n . x + w(x) = d, by Newton's method from the place at rest.
  std::optional<Eigen::Vector2d> on_line(size_t k, size_t f, double d_mm, double along_mm) const {
    const Eigen::Vector2d normal = tracked_.waves[f].per_mm.normalized();
    const Eigen::Vector2d along(-normal.y(), normal.x());
    const MotionField& motion = tracked_.motion[f];
    double across_mm = d_mm;
    for (int step = 0; step < 20; ++step) {
      const Eigen::Vector2d x = across_mm * normal + along_mm * along;
      const double off = across_mm + motion.value_mm(k, x) - d_mm;
      across_mm -= off;
      if (std::abs(off) < 1e-4) return across_mm * normal + along_mm * along;
    }
    return std::nullopt;
  }

  void emit_lines(size_t k, size_t f) {
    const TagWave& wave = tracked_.waves[f];
    const double spacing_mm = wave.spacing_mm();
    const Eigen::Vector2d normal = wave.per_mm.normalized();
    const Eigen::Vector2d along(-normal.y(), normal.x());
    Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300), high = -low;  // across, along
    for (const Eigen::Vector2d& corner :
         {Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1), Eigen::Vector2d(1, 1)}) {
      const Eigen::Vector2d x = corner.cwiseProduct(view_.extent_mm());
      const Eigen::Vector2d here(x.dot(normal), x.dot(along));
      low = low.cwiseMin(here);
      high = high.cwiseMax(here);
    }
    const double step_mm = 0.5 * view_.plane.finer_spacing_mm();
    const double edge_mm = edge_in_pixels * view_.plane.finer_spacing_mm();
    const int first = static_cast<int>(std::floor(low.x() / spacing_mm - wave.offset_cycles)) - 1;
    const int last = static_cast<int>(std::ceil(high.x() / spacing_mm - wave.offset_cycles)) + 1;
    for (int number = first; number <= last; ++number) {
      const double d_mm = (number + wave.offset_cycles) * spacing_mm;
      std::vector<Eigen::Vector2d> piece;
      for (double along_mm = low.y(); along_mm <= high.y() + step_mm; along_mm += step_mm) {
        const Eigen::Vector2d rest = d_mm * normal + along_mm * along;
        const bool near = depth_at(k, rest) > -spacing_mm;
        const auto x = near ? on_line(k, f, d_mm, along_mm) : std::nullopt;
        if (x && depth_at(k, *x) >= edge_mm) {
          piece.push_back(*x);
        } else {
          emit_piece(k, f, d_mm, piece, step_mm);
          piece.clear();
        }
      }
      emit_piece(k, f, d_mm, piece, step_mm);
    }
  }

  void emit_piece(size_t k, size_t f, double d_mm, const std::vector<Eigen::Vector2d>& piece,
                  double step_mm) {
    if (piece.empty()) return;
    const double length_mm = static_cast<double>(piece.size()) * step_mm;
    const auto count =
        static_cast<size_t>(std::ceil(length_mm / (apart_in_spacings * tracked_.waves[f].spacing_mm())));
    for (size_t i = 0; i < count; ++i)
      emit_point(k, f, d_mm, piece[(2 * i + 1) * piece.size() / (2 * count)]);
  }

  void emit_point(size_t k, size_t f, double d_mm, const Eigen::Vector2d& x_mm) {
    const TagWave& wave = tracked_.waves[f];
    const double spacing_mm = wave.spacing_mm();
    const Eigen::Vector2d normal = wave.per_mm.normalized();
    const MotionField& motion = tracked_.motion[f];
    // The line moves across itself by what w errs, over how fast n . X changes along the normal.
    const double h = 0.1 * spacing_mm;
    const double change =
        1 + (motion.value_mm(k, x_mm + h * normal) - motion.value_mm(k, x_mm - h * normal)) / (2 * h);
    const double sigma_mm = motion.sigma_mm(k, x_mm) / std::max(change, 0.2);
    const Surroundings around = surroundings(k, f, x_mm);
    const auto drop = [&](const char* reason) { ++points_.dropped[reason]; };
    if (!(sigma_mm <= most_sigma_in_spacings * spacing_mm))
      return drop("uncertain: faded, or too little of it is seen");
    if (around.excess > most_excess) return drop("another picture lies over it: a ghost, a fold or an edge");
    if (std::abs(around.pull_mm) >
        std::max(most_pull_in_sigmas * around.pull_sigma_mm, most_pull_in_spacings * spacing_mm))
      return drop("the image is not where the line is: a jump, or motion too sharp");
    TagPoint point;
    point.frame = view_.frames[k];
    point.normal = normal.x() * view_.plane.along_row + normal.y() * view_.plane.along_column;
    point.plane_mm = d_mm + point.normal.dot(view_.plane.origin_mm);
    point.x_mm = view_.plane.at(x_mm);
    point.sigma_mm = sigma_mm;
    points_.points.push_back(point);
  }

  Surroundings surroundings(size_t k, size_t f, const Eigen::Vector2d& x_mm) const {
    const TrackedPhase& phase = tracked_.phases[k];
    const double radius_mm = tracked_.waves[f].spacing_mm();
    const SlicePlane& plane = view_.plane;
    const auto from = [&](double at_mm, double spacing_mm) {
      return std::max<Eigen::Index>(0,
                                    static_cast<Eigen::Index>(std::ceil((at_mm - radius_mm) / spacing_mm)));
    };
    const auto to = [&](double at_mm, double spacing_mm, int count) {
      return std::min<Eigen::Index>(count - 1,
                                    static_cast<Eigen::Index>(std::floor((at_mm + radius_mm) / spacing_mm)));
    };
    double squares = 0, slopes = 0, products = 0;
    Surroundings around;
    for (Eigen::Index c = from(x_mm.x(), plane.column_spacing_mm);
         c <= to(x_mm.x(), plane.column_spacing_mm, plane.columns); ++c) {
      for (Eigen::Index r = from(x_mm.y(), plane.row_spacing_mm);
           r <= to(x_mm.y(), plane.row_spacing_mm, plane.rows); ++r) {
        const double slope = static_cast<double>(phase.slope[f](r, c));
        const double residual = static_cast<double>(phase.residual(r, c));
        if (slope == 0 || (view_.place_mm(r, c) - x_mm).norm() > radius_mm) continue;
        around.pixels += 1;
        squares += residual * residual;
        slopes += slope * slope;
        products += slope * residual;
      }
    }
    if (around.pixels > 0) around.excess = squares / (around.pixels * phase.noise * phase.noise);
    if (slopes > 0) {
      around.pull_mm = products / slopes;
      around.pull_sigma_mm = phase.noise * std::sqrt(tracked_.noise_factor[f] / slopes);
    }
    return around;
  }

  const TagView& view_;
  const TrackedView& tracked_;
  TagPoints points_;
};

}  // namespace

TagPoints tag_points(const TagView& view, const TrackedView& tracked) {
  return Emitter(view, tracked).emit();
}

}  // namespace diastole::imaging
