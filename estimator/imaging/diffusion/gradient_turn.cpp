#include "estimator/imaging/diffusion/gradient_turn.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "estimator/imaging/diffusion/wall_agreement.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole::imaging {
namespace {

/// Right tables of nine labelled ventricles seem turned by 0.3 to 4.7 degrees; the most where helix angles vary by 12 degrees around the
/// wall and fibres leave it by 6.
constexpr double least_turn_deg = 8;
/// Of six parts' spread: Student's t with 5 degrees of freedom exceeds 4 by chance in one of a hundred tables.
constexpr double clear_sigmas = 4;
/// Beyond, another exchange of axes is nearer.
constexpr double most_turn_deg = 45;
/// Of the circumference: a helix that varies by 12 degrees around it differs by 3 within one.
constexpr size_t sectors = 12;
constexpr size_t axial_parts = 6;

Eigen::Matrix3d rotation_by(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix()
                   : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
}

Eigen::Vector3d vector_of(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

/// Voxels with the sector and the part of the long axis that they lie in.
class SectoredWall {
 public:
  SectoredWall(const std::vector<WallVoxel>& voxels, const Eigen::Matrix3d& change) : change_(change) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const WallVoxel& voxel : voxels) {
      centre += voxel.voxel->place_mm / static_cast<double>(voxels.size());
      up_ += voxel.middle_axes().col(1);
    }
    up_.normalize();
    const Eigen::Vector3d right = up_.unitOrthogonal(), towards = up_.cross(right);
    std::vector<double> heights;
    for (const WallVoxel& voxel : voxels)
      heights.push_back(up_.dot(voxel.voxel->place_mm - centre));
    const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
    const double length = std::max(*high - *low, 1e-9);
    for (size_t i = 0; i < voxels.size(); ++i) {
      const Eigen::Vector3d from = voxels[i].voxel->place_mm - centre;
      const double around = std::atan2(from.dot(towards), from.dot(right)) / (2 * std::numbers::pi) + 0.5;
      voxels_.push_back(
          {&voxels[i], std::min(sectors - 1, static_cast<size_t>(around * sectors)),
           std::min(axial_parts - 1, static_cast<size_t>((heights[i] - *low) / length * axial_parts))});
    }
  }

  [[nodiscard]] const Eigen::Vector3d& long_axis() const { return up_; }

  /// The agreement but for its denominator, which no rotation changes.
  [[nodiscard]] double agreeing(const Eigen::Matrix3d& rotation, size_t without_part) const {
    const Eigen::Matrix3d change = rotation * change_;
    std::array<HelixCourse, sectors> courses;
    for (const Placed& placed : voxels_)
      if (placed.part != without_part)
        courses[placed.sector].add(placed.voxel->depth, deviator_in_wall(*placed.voxel, change));
    double sum = 0;
    for (const HelixCourse& course : courses)
      sum += agreeing_part(course);
    return sum;
  }

  /// Rotation vector (radians) by steps along three axes that are halved where none gains: from a twentieth of a turn, which the maximum is
  /// wider than, to a fifth of a degree.
  [[nodiscard]] Eigen::Vector3d best_turn(size_t without_part, const Eigen::Vector3d& start,
                                          double first_step_deg) const {
    Eigen::Matrix3d rotation = rotation_by(start);
    double best = agreeing(rotation, without_part);
    for (double step = first_step_deg * rad_per_deg; step > 0.2 * rad_per_deg; step /= 2) {
      for (bool gains = true; gains;) {
        gains = false;
        for (int k = 0; k < 6; ++k) {
          const Eigen::Matrix3d next =
              rotation_by((k < 3 ? step : -step) * Eigen::Vector3d::Unit(k % 3)) * rotation;
          const double agreement = agreeing(next, without_part);
          if (agreement <= best * (1 + 1e-9)) continue;
          best = agreement;
          rotation = next;
          gains = true;
        }
      }
    }
    return vector_of(rotation);
  }

 private:
  struct Placed {
    const WallVoxel* voxel;
    size_t sector, part;
  };
  Eigen::Matrix3d change_;
  Eigen::Vector3d up_ = Eigen::Vector3d::Zero();
  std::vector<Placed> voxels_;
};

}  // namespace

bool GradientTurn::clear(double part_deg) const {
  return part_deg > least_turn_deg && part_deg > clear_sigmas * sigma_deg && angle_deg < most_turn_deg;
}

std::string GradientTurn::name() const {
  const Eigen::Vector3d axis = vector_of(rotation).normalized();
  return fmt::format("{:.0f} degrees about ({:.2f}, {:.2f}, {:.2f})", angle_deg, axis.x(), axis.y(),
                     axis.z());
}

GradientTurn find_gradient_turn(const std::vector<WallVoxel>& voxels, const Eigen::Matrix3d& change) {
  const SectoredWall wall(voxels, change);
  const Eigen::Vector3d turn = wall.best_turn(axial_parts, Eigen::Vector3d::Zero(), 18);
  GradientTurn found;
  found.rotation = rotation_by(turn);
  found.angle_deg = turn.norm() / rad_per_deg;
  found.across_deg = (turn - turn.dot(wall.long_axis()) * wall.long_axis()).norm() / rad_per_deg;
  if (found.angle_deg < least_turn_deg) return found;
  // The jackknife's variance: (n - 1)/n of the squares about the mean.
  std::array<Eigen::Vector3d, axial_parts> without;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (size_t part = 0; part < axial_parts; ++part) {
    without[part] = wall.best_turn(part, turn, 4);
    mean += without[part] / axial_parts;
  }
  double squares = 0;
  for (const Eigen::Vector3d& one : without)
    squares += (one - mean).squaredNorm();
  found.sigma_deg = std::sqrt((axial_parts - 1.0) / axial_parts * squares) / rad_per_deg;
  return found;
}

}  // namespace diastole::imaging
