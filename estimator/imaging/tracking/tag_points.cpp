#include "estimator/imaging/tracking/tag_points.hpp"

#include <cmath>

#include "estimator/imaging/tracking/robust_weight.hpp"

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
/// The pixels around a point see its tag within half a spacing of where it was followed, or they see another.
constexpr double most_own_in_spacings = 0.5;

/// A place on a tracked line.
struct Place {
  int tag;
  double d_mm;  // of its tag
  Eigen::Vector2d x_mm;
  double information = 0;  // of w, from the pixels nearest to this place, 1/mm^2
  double gradient = 0;     // of the log likelihood there, 1/mm
};

struct Surroundings {
  double pixels = 0;
  double excess = 0;   // mean squared residual over the noise's variance
  double pull_mm = 0;  // the shift that the residual asks for
  double pull_sigma_mm = 0;
};

class Emitter {
 public:
  Emitter(const TagView& view, const TrackedView& tracked) : view_(view), tracked_(tracked) {}

  TrackedPoints emit() {
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
    places_.clear();
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
          choose_places(f, number, piece, step_mm);
          piece.clear();
        }
      }
      choose_places(f, number, piece, step_mm);
    }
    share_pixels(k, f);
    factor_ = tracked_.motion[f].covariance.phase_factor(k);
    for (const Place& place : places_)
      emit_point(k, f, place);
  }

  void choose_places(size_t f, int number, const std::vector<Eigen::Vector2d>& piece, double step_mm) {
    if (piece.empty()) return;
    const double d_mm = (number + tracked_.waves[f].offset_cycles) * tracked_.waves[f].spacing_mm();
    const double length_mm = static_cast<double>(piece.size()) * step_mm;
    const auto count =
        static_cast<size_t>(std::ceil(length_mm / (apart_in_spacings * tracked_.waves[f].spacing_mm())));
    for (size_t i = 0; i < count; ++i)
      places_.push_back({number, d_mm, piece[(2 * i + 1) * piece.size() / (2 * count)]});
  }

  /// Gives each pixel that was fitted to the nearest place within a spacing: no pixel counts twice.
  void share_pixels(size_t k, size_t f) {
    const TrackedPhase& phase = tracked_.phases[k];
    const double reach_mm = tracked_.waves[f].spacing_mm();
    Eigen::ArrayXXd nearest_mm = Eigen::ArrayXXd::Constant(view_.plane.rows, view_.plane.columns, reach_mm);
    Eigen::ArrayXXi owner = Eigen::ArrayXXi::Constant(view_.plane.rows, view_.plane.columns, -1);
    for (size_t i = 0; i < places_.size(); ++i) {
      each_pixel_near(places_[i].x_mm, reach_mm, [&](Eigen::Index row, Eigen::Index column, double apart_mm) {
        if (apart_mm >= nearest_mm(row, column)) return;
        nearest_mm(row, column) = apart_mm;
        owner(row, column) = static_cast<int>(i);
      });
    }
    for (Eigen::Index column = 0; column < owner.cols(); ++column) {
      for (Eigen::Index row = 0; row < owner.rows(); ++row) {
        const double slope = static_cast<double>(phase.slope[f](row, column));
        if (owner(row, column) < 0 || slope == 0) continue;
        const double residual = static_cast<double>(phase.residual(row, column));
        const double variance = phase.noise * phase.noise * tracked_.noise_factor[f] *
                                (1 + tracked_.excess.at(phase, row, column));
        const double weight = huber_weight(residual, phase.noise) / variance;
        Place& place = places_[static_cast<size_t>(owner(row, column))];
        place.information += weight * slope * slope;
        place.gradient += weight * slope * residual;
      }
    }
  }

  /// `visit(row, column, distance)` for every pixel within a distance.
  template <class Visit>
  void each_pixel_near(const Eigen::Vector2d& x_mm, double reach_mm, const Visit& visit) const {
    const SlicePlane& plane = view_.plane;
    const auto from = [&](double at_mm, double spacing_mm) {
      return std::max<Eigen::Index>(0, static_cast<Eigen::Index>(std::ceil((at_mm - reach_mm) / spacing_mm)));
    };
    const auto to = [&](double at_mm, double spacing_mm, int count) {
      return std::min<Eigen::Index>(count - 1,
                                    static_cast<Eigen::Index>(std::floor((at_mm + reach_mm) / spacing_mm)));
    };
    for (Eigen::Index column = from(x_mm.x(), plane.column_spacing_mm);
         column <= to(x_mm.x(), plane.column_spacing_mm, plane.columns); ++column) {
      for (Eigen::Index row = from(x_mm.y(), plane.row_spacing_mm);
           row <= to(x_mm.y(), plane.row_spacing_mm, plane.rows); ++row) {
        const double apart_mm = (view_.place_mm(row, column) - x_mm).norm();
        if (apart_mm <= reach_mm) visit(row, column, apart_mm);
      }
    }
  }

  void emit_point(size_t k, size_t f, const Place& place) {
    const Eigen::Vector2d& x_mm = place.x_mm;
    const TagWave& wave = tracked_.waves[f];
    const double spacing_mm = wave.spacing_mm();
    const Eigen::Vector2d normal = wave.per_mm.normalized();
    const MotionField& motion = tracked_.motion[f];
    // The line moves across itself by what w errs, over how fast n . X changes along the normal.
    const double h = 0.1 * spacing_mm;
    const double change =
        1 + (motion.value_mm(k, x_mm + h * normal) - motion.value_mm(k, x_mm - h * normal)) / (2 * h);
    const double ghost_mm = ghost_sigma_mm(k, f, x_mm);
    const double sigma_mm =
        std::hypot(motion.sigma_mm(factor_, x_mm), ghost_mm, through_plane_mm(motion, k, x_mm, spacing_mm)) /
        std::max(change, 0.2);
    const Surroundings around = surroundings(k, f, x_mm);
    const auto drop = [&](const char* reason) {
      ++points_.dropped[reason];
      points_.rejected.push_back({view_.frames[k], static_cast<int>(f), x_mm, reason});
    };
    if (view_.is_masked(k, std::lround(x_mm.y() / view_.plane.row_spacing_mm),
                        std::lround(x_mm.x() / view_.plane.column_spacing_mm)))
      return drop("masked by hand");
    if (!(sigma_mm <= most_sigma_in_spacings * spacing_mm))
      return drop("uncertain: faded, or too little of it is seen");
    if (around.excess > most_excess) return drop("another picture lies over it: a ghost, a fold or an edge");
    if (std::abs(around.pull_mm) >
        std::max(most_pull_in_sigmas * around.pull_sigma_mm, most_pull_in_spacings * spacing_mm))
      return drop("the image is not where the line is: a jump, or motion too sharp");
    // The line n x = d - w moves against w.
    const double own_mm = -place.gradient / std::max(place.information, 1e-300) / std::max(change, 0.2);
    if (!(std::abs(own_mm) < most_own_in_spacings * spacing_mm))
      return drop("the image is not where the line is: a jump, or motion too sharp");
    TrackedPoint point;
    point.frame = view_.frames[k];
    point.direction = static_cast<int>(f);
    point.tag = place.tag;
    point.normal = normal.x() * view_.plane.along_row + normal.y() * view_.plane.along_column;
    point.plane_mm = place.d_mm + point.normal.dot(view_.plane.origin_mm);
    point.x_mm = view_.plane.at(x_mm);
    point.sigma_mm = sigma_mm;
    // Pixels that say nothing leave the tag anywhere in its spacing.
    point.own_mm = place.information > 0 ? own_mm : 0.0;
    point.own_sigma_mm =
        std::min(spacing_mm, std::hypot(1.0 / std::sqrt(std::max(place.information, 1e-300)), ghost_mm) /
                                 std::max(change, 0.2));
    points_.points.push_back(point);
  }

  /// A pixel shows the mean of its tags over the slice's thickness T, which differs from that of its middle by  T^2 / 24  times
  /// the motion's curvature through the slice. That is not seen: it is as large as within the slice.
  double through_plane_mm(const MotionField& motion, size_t k, const Eigen::Vector2d& x_mm,
                          double h_mm) const {
    const auto at = [&](double across, double down) {
      return motion.value_mm(k, x_mm + h_mm * Eigen::Vector2d(across, down));
    };
    const double here = at(0, 0);
    const double xx = at(1, 0) + at(-1, 0) - 2 * here, yy = at(0, 1) + at(0, -1) - 2 * here;
    const double xy = 0.25 * (at(1, 1) + at(-1, -1) - at(1, -1) - at(-1, 1));
    const double thickness_mm = view_.plane.thickness_mm;
    return thickness_mm * thickness_mm / 24 * std::sqrt(xx * xx + yy * yy + 2 * xy * xy) / (h_mm * h_mm);
  }

  /// What is not known of ghosts moves a tag by the shift that their picture asks of the pixels around.
  double ghost_sigma_mm(size_t k, size_t f, const Eigen::Vector2d& x_mm) const {
    double variance = 0;
    for (const Ghost& ghost : tracked_.ghosts) {
      double count = 0, slopes = 0, overs = 0, squares = 0, products = 0;
      each_pixel_near(x_mm, tracked_.waves[f].spacing_mm(),
                      [&](Eigen::Index row, Eigen::Index column, double) {
                        const double slope = static_cast<double>(tracked_.phases[k].slope[f](row, column));
                        if (slope == 0) return;
                        const double over = ghost.over(view_.images[k], row, column);
                        count += 1;
                        slopes += slope;
                        overs += over;
                        squares += slope * slope;
                        products += slope * over;
                      });
      // Of a ghost's mean over the circle the brightness takes account.
      if (squares > 0)
        variance +=
            std::pow(ghost.in_phase_sigma / ghost.share * (products - slopes * overs / count) / squares, 2);
    }
    return std::sqrt(variance);
  }

  Surroundings surroundings(size_t k, size_t f, const Eigen::Vector2d& x_mm) const {
    const TrackedPhase& phase = tracked_.phases[k];
    double squares = 0, slopes = 0, products = 0;
    Surroundings around;
    each_pixel_near(x_mm, tracked_.waves[f].spacing_mm(), [&](Eigen::Index row, Eigen::Index column, double) {
      const double slope = static_cast<double>(phase.slope[f](row, column));
      const double residual = static_cast<double>(phase.residual(row, column));
      if (slope == 0) return;
      around.pixels += 1;
      squares += residual * residual;
      slopes += slope * slope;
      products += slope * residual;
    });
    if (around.pixels > 0) around.excess = squares / (around.pixels * phase.noise * phase.noise);
    if (slopes > 0) {
      around.pull_mm = products / slopes;
      around.pull_sigma_mm = phase.noise * std::sqrt(tracked_.noise_factor[f] / slopes);
    }
    return around;
  }

  const TagView& view_;
  const TrackedView& tracked_;
  TrackedPoints points_;
  // Of the phase and direction at hand:
  std::vector<Place> places_;
  Eigen::MatrixXd factor_;  // of the motion's covariance
};

}  // namespace

TrackedPoints tag_points(const TagView& view, const TrackedView& tracked) {
  return Emitter(view, tracked).emit();
}

}  // namespace diastole::imaging
