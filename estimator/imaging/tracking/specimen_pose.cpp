#include "estimator/imaging/tracking/specimen_pose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"
#include "protocol/signal/median.hpp"

namespace diastole::imaging {
namespace {

using signal::median;

constexpr int rays = 72;
/// A ring is whole: tags and noise may blur a few rays.
constexpr double least_share_of_rays = 0.9;
/// Circles of one body have the same radius to this share, and its points lie on them to this distance: a ventricle's do not.
constexpr double most_radius_spread = 0.04;
constexpr double most_circle_rms_mm = 1.0;
/// Slices along the axis are at a right angle to the others to 5 degrees.
constexpr double most_cosine_along = 0.09;
constexpr double most_end_spread_mm = 1.0;

double spread(const std::vector<double>& values) {
  const double centre = median(values);
  std::vector<double> off;
  for (const double value : values)
    off.push_back(std::abs(value - centre));
  return signal::deviation_of_normal(std::move(off));
}

/// Depth between pixels; far outside where there is no image.
double depth_at(const TagView& view, const Eigen::ArrayXXf& depth, const Eigen::Vector2d& x_mm) {
  const double column = x_mm.x() / view.plane.column_spacing_mm;
  const double row = x_mm.y() / view.plane.row_spacing_mm;
  const auto c = static_cast<Eigen::Index>(std::floor(column));
  const auto r = static_cast<Eigen::Index>(std::floor(row));
  if (c < 0 || r < 0 || c + 1 >= depth.cols() || r + 1 >= depth.rows()) return -1e3;
  const double u = column - static_cast<double>(c), v = row - static_cast<double>(r);
  return (1 - v) * ((1 - u) * static_cast<double>(depth(r, c)) + u * static_cast<double>(depth(r, c + 1))) +
         v * ((1 - u) * static_cast<double>(depth(r + 1, c)) + u * static_cast<double>(depth(r + 1, c + 1)));
}

struct Circle {
  Eigen::Vector2d centre_mm;
  double radius_mm;
  double rms_mm;
};

/// Least squares of |x|^2 = 2 c . x + (r^2 - |c|^2) (Kasa, IEEE Trans. Instrum. Meas. 25 (1976) 8): for points all around, its bias is
/// nothing.
Circle fitted_circle(const std::vector<Eigen::Vector2d>& points) {
  Eigen::MatrixXd matrix(static_cast<Eigen::Index>(points.size()), 3);
  Eigen::VectorXd right(matrix.rows());
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    const Eigen::Vector2d& point = points[static_cast<size_t>(i)];
    matrix.row(i) << 2 * point.x(), 2 * point.y(), 1;
    right[i] = point.squaredNorm();
  }
  const Eigen::VectorXd solution = matrix.colPivHouseholderQr().solve(right);
  Circle circle{solution.head<2>(), std::sqrt(std::max(0.0, solution[2] + solution.head<2>().squaredNorm())),
                0};
  for (const Eigen::Vector2d& point : points)
    circle.rms_mm += std::pow((point - circle.centre_mm).norm() - circle.radius_mm, 2);
  circle.rms_mm = std::sqrt(circle.rms_mm / static_cast<double>(points.size()));
  return circle;
}

struct Ring {
  Circle inner, outer;
};

/// The two circles of one image, if its tissue is a ring.
std::optional<Ring> ring_of(const TagView& view, const TrackedPhase& phase) {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double pixels = 0;
  for (Eigen::Index column = 0; column < phase.depth_mm.cols(); ++column) {
    for (Eigen::Index row = 0; row < phase.depth_mm.rows(); ++row) {
      if (phase.depth_mm(row, column) <= 0) continue;
      centre += view.place_mm(row, column);
      pixels += 1;
    }
  }
  if (pixels == 0) return std::nullopt;
  centre /= pixels;
  const double step_mm = 0.25 * view.plane.finer_spacing_mm();
  std::vector<Eigen::Vector2d> inner, outer;
  for (int ray = 0; ray < rays; ++ray) {
    const double angle = 2 * std::numbers::pi * ray / rays;
    const Eigen::Vector2d way(std::cos(angle), std::sin(angle));
    std::optional<double> first, last;
    double before = depth_at(view, phase.depth_mm, centre);
    if (before > 0) return std::nullopt;
    for (double radius = step_mm; radius < view.extent_mm().norm(); radius += step_mm) {
      const double here = depth_at(view, phase.depth_mm, centre + radius * way);
      const double crossing = radius - step_mm * here / (here - before);
      if (before <= 0 && here > 0 && !first) first = crossing;
      if (before > 0 && here <= 0 && here > -900) last = crossing;
      before = here;
    }
    if (!first || !last) continue;
    inner.push_back(centre + *first * way);
    outer.push_back(centre + *last * way);
  }
  if (static_cast<double>(inner.size()) < least_share_of_rays * rays) return std::nullopt;
  const Ring ring{fitted_circle(inner), fitted_circle(outer)};
  if (ring.inner.rms_mm > most_circle_rms_mm || ring.outer.rms_mm > most_circle_rms_mm) return std::nullopt;
  return ring;
}

struct RingSlice {
  const TagView* view;
  Eigen::Vector3d centre_mm;
  double inner_mm, outer_mm;  // in the first phase
};

std::optional<RingSlice> ring_slice(const TrackedSlice& slice) {
  std::vector<double> across, down;
  std::optional<Ring> first;
  for (const TrackedPhase& phase : slice.tracked.phases) {
    const auto ring = ring_of(slice.view, phase);
    if (!ring) continue;
    if (!first) first = ring;
    for (const Circle& circle : {ring->inner, ring->outer}) {
      across.push_back(circle.centre_mm.x());
      down.push_back(circle.centre_mm.y());
    }
  }
  if (across.size() < slice.tracked.phases.size()) return std::nullopt;  // seen in half of the phases
  return RingSlice{&slice.view, slice.view.plane.at({median(across), median(down)}), first->inner.radius_mm,
                   first->outer.radius_mm};
}

struct Ends {
  std::vector<double> low_mm, high_mm;  // along the axis, from the origin
};

/// Where lines along the axis enter and leave the tissue of a slice that contains it. Lines in the cavity and close to the walls' faces do
/// not count.
void add_ends(const TrackedSlice& slice, const Eigen::Vector3d& origin_mm, const Eigen::Vector3d& axis,
              double inner_mm, double outer_mm, Ends& ends) {
  const TagView& view = slice.view;
  const Eigen::Vector2d start = view.plane.in_plane_mm(origin_mm);
  const Eigen::Vector2d along =
      Eigen::Vector2d(axis.dot(view.plane.along_row), axis.dot(view.plane.along_column)).normalized();
  const Eigen::Vector2d across(-along.y(), along.x());
  const double step_mm = 0.25 * view.plane.finer_spacing_mm();
  const double wall_mm = outer_mm - inner_mm;
  const double reach_mm = view.extent_mm().norm();
  for (const TrackedPhase& phase : slice.tracked.phases) {
    for (const double side : {-1.0, 1.0}) {
      for (double share = 0.3; share < 0.75; share += 0.1) {
        const Eigen::Vector2d line = start + side * (inner_mm + share * wall_mm) * across;
        std::optional<double> low, high;
        double before = depth_at(view, phase.depth_mm, line - reach_mm * along);
        for (double at = -reach_mm + step_mm; at < reach_mm; at += step_mm) {
          const double here = depth_at(view, phase.depth_mm, line + at * along);
          if (before <= 0 && before > -900 && here > 0 && !low) low = at - step_mm * here / (here - before);
          if (before > 0 && here <= 0 && here > -900) high = at - step_mm * here / (here - before);
          before = here;
        }
        if (!low || !high) continue;
        ends.low_mm.push_back(*low);
        ends.high_mm.push_back(*high);
      }
    }
  }
}

Eigen::Matrix3d axes_about(Eigen::Vector3d axis) {
  Eigen::Index largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  if (axis[largest] < 0) axis = -axis;
  const Eigen::Vector3d patient_x = largest == 0 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
  Eigen::Matrix3d axes;
  axes.col(2) = axis;
  axes.col(0) = (patient_x - patient_x.dot(axis) * axis).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

/// How far along the axis from the origin mid-height lies by what a person said of slices; nothing if of none, a message in `missing` if
/// that does not fit.
std::optional<double> given_mid_height_mm(const std::vector<TrackedSlice>& slices,
                                          const Eigen::Vector3d& origin_mm, const Eigen::Vector3d& axis,
                                          std::string& missing) {
  std::vector<double> heights;
  for (const TrackedSlice& slice : slices) {
    const TagView& view = slice.view;
    if (!view.height_mm) continue;
    const double cosine = view.plane.normal().dot(axis);
    if (std::abs(cosine) < std::sqrt(1 - most_cosine_along * most_cosine_along)) {
      missing = fmt::format("{}, whose height is given, does not lie across the axis", view.name);
      return std::nullopt;
    }
    heights.push_back((view.plane.origin_mm - origin_mm).dot(view.plane.normal()) / cosine - *view.height_mm);
  }
  if (heights.empty()) return std::nullopt;
  const auto [least, most] = std::minmax_element(heights.begin(), heights.end());
  if (*most - *least > most_end_spread_mm) {
    missing =
        fmt::format("the heights given for slices put mid-height at places {:.1f} mm apart", *most - *least);
    return std::nullopt;
  }
  return 0.5 * (*least + *most);
}

constexpr const char* give_pose =
    "Give the specimen's pose with --pose NAME.pose.toml (origin_mm, x_axis, y_axis, z_axis).";

/// What to write where rings show the axis but nothing shows mid-height.
std::string give_height(const RingSlice& ring) {
  return fmt::format(
      "Say how far a slice lies over mid-height: the line {{\"slice\": \"{}\", \"action\": \"height\", "
      "\"height_mm\": 0}} in FOLDER.edits.jsonl, beside the folder, says that it lies there. Or give the "
      "pose "
      "with --pose NAME.pose.toml (origin_mm, x_axis, y_axis, z_axis).",
      ring.view->name);
}

}  // namespace

TrackedPoint SpecimenPose::to_specimen(const TrackedPoint& patient) const {
  TrackedPoint point = patient;
  point.normal = axes.transpose() * patient.normal;
  point.plane_mm = patient.plane_mm - patient.normal.dot(origin_mm);
  point.x_mm = axes.transpose() * (patient.x_mm - origin_mm);
  return point;
}

SpecimenPose read_pose(const std::filesystem::path& file) {
  TableReader root = TableReader::from_file(file);
  SpecimenPose pose;
  (void)root.text_or("kind", "");
  const auto vector = [&](const char* key) -> Eigen::Vector3d {
    const std::vector<double> numbers = root.numbers(key, 3);
    return {numbers[0], numbers[1], numbers[2]};
  };
  pose.origin_mm = vector("origin_mm");
  // One by one: the matrix's list of commas bears no exception in its middle.
  pose.axes.col(0) = vector("x_axis");
  pose.axes.col(1) = vector("y_axis");
  pose.axes.col(2) = vector("z_axis");
  root.finish();
  const double off = (pose.axes.transpose() * pose.axes - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off <= 1e-3 && pose.axes.determinant() > 0))
    throw InputError(
        {file.string(), "keys x_axis, y_axis, z_axis",
         fmt::format("are no right-handed axes of length 1 at right angles (off by {:.3g})", off),
         "Give the specimen's axes in patient coordinates, each with three numbers of five digits or more."});
  pose.source = file.string();
  return pose;
}

std::string pose_text(const SpecimenPose& pose, const std::string& kind) {
  const auto line = [](const char* key, const Eigen::Vector3d& v, int digits) {
    return fmt::format("{} = [{:.{}f}, {:.{}f}, {:.{}f}]\n", key, v.x(), digits, v.y(), digits, v.z(),
                       digits);
  };
  return "# The specimen's frame in patient coordinates: x_patient = origin + X x_axis + Y y_axis + Z "
         "z_axis\n" +
         fmt::format("kind = \"{}\"\n", kind) + line("origin_mm", pose.origin_mm, 4) +
         line("x_axis", pose.axes.col(0), 8) + line("y_axis", pose.axes.col(1), 8) +
         line("z_axis", pose.axes.col(2), 8);
}

FoundPose find_annulus_pose(const std::vector<TrackedSlice>& slices) {
  FoundPose found;
  found.remedy = give_pose;
  std::vector<RingSlice> rings;
  for (const TrackedSlice& slice : slices) {
    const auto ring = ring_slice(slice);
    if (ring &&
        (rings.empty() || std::abs(ring->view->plane.normal().dot(rings[0].view->plane.normal())) > 0.9999))
      rings.push_back(*ring);
  }
  if (rings.empty()) {
    found.missing = "no slice shows a ring, whose middle would be the axis";
    return found;
  }
  std::vector<double> inner, outer;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const RingSlice& ring : rings) {
    inner.push_back(ring.inner_mm);
    outer.push_back(ring.outer_mm);
    centre += ring.centre_mm / static_cast<double>(rings.size());
  }
  const auto [least, most] = std::minmax_element(outer.begin(), outer.end());
  if (*most - *least > most_radius_spread * *most) {
    found.missing = fmt::format(
        "the rings have outer radii from {:.1f} to {:.1f} mm: the specimen is no annulus", *least, *most);
    return found;
  }
  const Eigen::Matrix3d axes = axes_about(rings[0].view->plane.normal());
  found.remedy = give_height(rings[0]);
  const auto given = given_mid_height_mm(slices, centre, axes.col(2), found.missing);
  if (!found.missing.empty()) return found;
  Ends ends;
  for (const TrackedSlice& slice : slices) {
    const Eigen::Vector3d normal = slice.view.plane.normal();
    const double beside_mm = std::abs((centre - slice.view.plane.origin_mm).dot(normal));
    if (std::abs(normal.dot(axes.col(2))) < most_cosine_along && beside_mm < 0.5 * median(inner))
      add_ends(slice, centre, axes.col(2), median(inner), median(outer), ends);
  }
  if (given) {
    found.pose = SpecimenPose{centre + *given * axes.col(2), axes,
                              fmt::format("outlines: {} rings; mid-height as given by hand", rings.size())};
    return found;
  }
  if (ends.low_mm.size() < 10) {
    found.missing = "no slice along the axis shows the specimen's two ends, between which mid-height lies";
    return found;
  }
  if (spread(ends.low_mm) > most_end_spread_mm || spread(ends.high_mm) > most_end_spread_mm) {
    found.missing = fmt::format("the ends are not straight: they scatter by {:.1f} and {:.1f} mm",
                                spread(ends.low_mm), spread(ends.high_mm));
    return found;
  }
  const double low = median(ends.low_mm), high = median(ends.high_mm);
  found.pose =
      SpecimenPose{centre + 0.5 * (low + high) * axes.col(2), axes,
                   fmt::format("outlines: {} rings, ends along {} lines", rings.size(), ends.low_mm.size())};
  found.outline = AnnulusOutline{median(inner), median(outer), high - low};
  return found;
}

}  // namespace diastole::imaging
