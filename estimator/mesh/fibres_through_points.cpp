#include "estimator/mesh/fibres_through_points.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "estimator/mesh/helix_course.hpp"
#include "estimator/mesh/nodal_lines.hpp"
#include "estimator/mesh/point_locator.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole {
namespace {

constexpr size_t least_points = 8;
constexpr double usual_bend_rad = 10 * rad_per_deg;
constexpr int most_iterations = 20;
constexpr double settled_rad = 1e-9;

struct Seen {
  size_t element;
  std::array<double, corners> basis;
  double depth = 0;
  Eigen::Vector3d direction;  ///< in wall axes, unit
  double weight;
};

std::vector<Seen> seen_in(const HermiteMesh& mesh, std::span<const FibrePoint> points,
                          const std::vector<double>& depths) {
  const PointLocator locator(mesh, mesh.reference());
  std::vector<Seen> all;
  for (const FibrePoint& point : points) {
    const auto located = locator.find(point.place_mm);
    if (!located) continue;
    const Eigen::Matrix3d wall = wall_axes(mesh, located->point);
    if (!wall.allFinite()) continue;  // on the apex
    Seen seen{located->point.element, trilinear_basis(located->point.xi), 0,
              wall.transpose() * point.direction.normalized(), std::pow(point.sigma_deg * rad_per_deg, -2)};
    for (size_t c = 0; c < corners; ++c)
      seen.depth += seen.basis[c] * depths[mesh.element(seen.element)[c]];
    all.push_back(seen);
  }
  return all;
}

/// Normal equations of nodal angles: one matrix for both.
class NodalFit {
 public:
  NodalFit(const HermiteMesh& mesh, const std::vector<Seen>& seen) : mesh_(mesh), seen_(seen) {
    std::vector<Eigen::Triplet<double>> entries;
    const auto add = [&](size_t i, size_t j, double value) {
      entries.emplace_back(static_cast<int>(i), static_cast<int>(j), value);
    };
    for (const Seen& point : seen)
      for (size_t i = 0; i < corners; ++i)
        for (size_t j = 0; j < corners; ++j)
          add(mesh.element(point.element)[i], mesh.element(point.element)[j],
              point.weight * point.basis[i] * point.basis[j]);
    constexpr std::array<double, 3> bend{1, -2, 1};
    const double stiffness = std::pow(usual_bend_rad, -2);
    for (const auto& difference : NodalLines(mesh).second_differences())
      for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j)
          add(difference.nodes[i], difference.nodes[j], stiffness * bend[i] * bend[j]);
    // A node that neither points nor neighbours know stays as it began.
    for (size_t node = 0; node < mesh.node_count(); ++node)
      add(node, node, 1e-6 * stiffness);
    matrix_.resize(static_cast<Eigen::Index>(mesh.node_count()),
                   static_cast<Eigen::Index>(mesh.node_count()));
    matrix_.setFromTriplets(entries.begin(), entries.end());
    factor_.compute(matrix_);
  }

  [[nodiscard]] double at(const Eigen::VectorXd& nodal, const Seen& point) const {
    double sum = 0;
    for (size_t c = 0; c < corners; ++c)
      sum += point.basis[c] * nodal[static_cast<Eigen::Index>(mesh_.element(point.element)[c])];
    return sum;
  }

  /// The field for these values at the points.
  [[nodiscard]] Eigen::VectorXd through(const std::vector<double>& values) const {
    Eigen::VectorXd right = Eigen::VectorXd::Zero(matrix_.rows());
    for (size_t p = 0; p < seen_.size(); ++p)
      for (size_t c = 0; c < corners; ++c)
        right[static_cast<Eigen::Index>(mesh_.element(seen_[p].element)[c])] +=
            seen_[p].weight * seen_[p].basis[c] * values[p];
    return factor_.solve(right);
  }

 private:
  const HermiteMesh& mesh_;
  const std::vector<Seen>& seen_;
  Eigen::SparseMatrix<double> matrix_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
};

std::vector<double> degrees(const Eigen::VectorXd& radians) {
  std::vector<double> all;
  for (const double value : radians)
    all.push_back(value / rad_per_deg);
  return all;
}

}  // namespace

FibresThroughPoints fibres_through_points(const HermiteMesh& mesh, std::span<const FibrePoint> points) {
  const std::vector<double> depths = NodalLines(mesh).depths();
  const std::vector<Seen> seen = seen_in(mesh, points, depths);
  if (seen.size() < least_points || 5 * seen.size() < points.size())
    throw std::invalid_argument(std::to_string(seen.size()) + " of " + std::to_string(points.size()) +
                                " points lie in the mesh");
  HelixCourse course;
  for (const Seen& point : seen)
    course.add(point.depth, point.direction * point.direction.transpose());
  const auto angles = course.angles_rad();

  const NodalFit fit(mesh, seen);
  Eigen::VectorXd helix(static_cast<Eigen::Index>(mesh.node_count()));
  for (size_t node = 0; node < mesh.node_count(); ++node)
    helix[static_cast<Eigen::Index>(node)] = angle_at(angles, depths[node]);
  std::vector<double> seen_helix(seen.size()), seen_transverse(seen.size());
  // The helix is known but for half turns: those nearest to the field are meant.
  for (int i = 0; i < most_iterations; ++i) {
    for (size_t p = 0; p < seen.size(); ++p) {
      const double field = fit.at(helix, seen[p]);
      const double angle = std::atan2(seen[p].direction.y(), seen[p].direction.x());
      seen_helix[p] = field + std::remainder(angle - field, std::numbers::pi);
    }
    const Eigen::VectorXd next = fit.through(seen_helix);
    const double change = (next - helix).cwiseAbs().maxCoeff();
    helix = next;
    if (change < settled_rad) break;
  }
  for (size_t p = 0; p < seen.size(); ++p) {
    const double angle = std::atan2(seen[p].direction.y(), seen[p].direction.x());
    const double sign = std::cos(seen_helix[p] - angle) < 0 ? -1 : 1;
    seen_transverse[p] = std::asin(std::clamp(sign * seen[p].direction.z(), -1.0, 1.0));
  }
  const Eigen::VectorXd transverse = fit.through(seen_transverse);

  double squares = 0;
  for (const Seen& point : seen) {
    const double alpha = fit.at(helix, point), gamma = fit.at(transverse, point);
    const Eigen::Vector3d f(std::cos(gamma) * std::cos(alpha), std::cos(gamma) * std::sin(alpha),
                            std::sin(gamma));
    squares += std::pow(std::acos(std::min(1.0, std::abs(f.dot(point.direction)))) / rad_per_deg, 2);
  }
  return {FibreField(degrees(helix), {}, degrees(transverse)), seen.size(),
          std::sqrt(squares / static_cast<double>(seen.size()))};
}

}  // namespace diastole
