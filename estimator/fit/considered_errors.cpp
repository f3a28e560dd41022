#include "estimator/fit/considered_errors.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "estimator/fe/unloaded_shape.hpp"
#include "estimator/fit/constrained_energy.hpp"
#include "estimator/mesh/collapsed_edge.hpp"
#include "estimator/mesh/nodal_lines.hpp"
#include "estimator/mesh/node_field.hpp"
#include "estimator/mesh/placed_mesh.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole {
namespace {

using Eigen::Vector3d;

using Turn = std::function<Eigen::AngleAxisd(const MaterialAxes& wall, const MaterialAxes& axes, double depth,
                                             double angle)>;

ConsideredError turned_fibres(const ElasticModel& model, double sigma_deg, Turn turn) {
  const std::vector<double> depths = NodalLines(model.mesh()).depths();
  return {"fibres",
          sigma_deg,
          [depths, turn = std::move(turn)](const ElasticModel& of, double amount_deg) {
            const MaterialAxesField turned = [depths, turn, amount_deg, axes = of.system().material_axes()](
                                                 const HermiteMesh& mesh, const MaterialPoint& point) {
              const MaterialAxes untouched = axes(mesh, point);
              return MaterialAxes(turn(wall_axes(mesh, point), untouched, between_nodes(mesh, depths, point),
                                       rad_per_deg * amount_deg)
                                      .toRotationMatrix() *
                                  untouched);
            };
            return alike(of.system(), of.mesh(), turned);
          },
          {}};
}

/// The field normal(xi) * weight(depth) at the nodes: value and first derivatives, by differences within an element; cross-derivatives zero.
NodeField along_normals(const HermiteMesh& mesh, const std::function<double(double)>& weight) {
  constexpr double step = 1e-3;
  const std::vector<double> depths = NodalLines(mesh).depths();
  const auto value = [&](const MaterialPoint& point) {
    return Vector3d(weight(between_nodes(mesh, depths, point)) * wall_axes(mesh, point).col(2));
  };
  NodeField sum(mesh.reference().size(), 0.0);
  std::vector<double> meeting(mesh.node_count(), 0.0);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (size_t c = 0; c < corners; ++c) {
      const size_t node = mesh.element(e)[c];
      MaterialPoint at{e, {}};
      for (size_t k = 0; k < 3; ++k)
        at.xi[k] = static_cast<double>(c >> k & 1);
      constexpr double beside = 0.02;  // of a corner on a collapsed edge, where the wall has no direction
      const MaterialPoint corner = beside_collapse(mesh, at, beside);
      const Vector3d here = value(corner);
      Eigen::Map<Vector3d>(&sum[dof_of(node, 0, 0)]) += here;
      for (size_t k = 0; k < 3; ++k) {
        MaterialPoint inside = corner;
        const double inwards = at.xi[k] == 0.0 ? step : -step;
        inside.xi[k] += inwards;
        const size_t derivative = size_t{1} << k;
        size_t a = 0;
        while (hermite_corner(a) != c || hermite_derivative(a) != derivative)
          ++a;
        Eigen::Map<Vector3d>(&sum[dof_of(node, derivative, 0)]) +=
            (value(inside) - here) / (inwards * mesh.scale(e, a));
      }
      meeting[node] += 1.0;
    }
  }
  for (size_t dof = 0; dof < sum.size(); ++dof)
    sum[dof] /= meeting[dof / dofs_per_node];
  for (const auto& [dof, other] : mesh.ties().same)
    sum[dof] = sum[other];
  for (const size_t dof : mesh.ties().zero)
    sum[dof] = 0.0;
  return sum;
}

ConsideredError moved_wall(const ElasticModel& model, double sigma_mm,
                           const std::function<double(double)>& weight) {
  NodeField shape = along_normals(model.mesh(), weight);
  return {"geometry", sigma_mm,
          [shape](const ElasticModel& of, double amount_mm) {
            NodeField reference = of.mesh().reference();
            add_scaled(reference, amount_mm, shape);
            return alike(of.system(), with_reference(of.mesh(), std::move(reference)),
                         of.system().material_axes());
          },
          shape};
}

}  // namespace

std::vector<ConsideredError> fibre_errors(const ElasticModel& model, double sigma_deg) {
  if (sigma_deg == 0.0) return {};
  using Eigen::AngleAxisd;
  const Turn helix = [](const MaterialAxes& wall, const MaterialAxes&, double, double angle) {
    return AngleAxisd(angle, wall.col(2));
  };
  const Turn slope = [](const MaterialAxes& wall, const MaterialAxes&, double depth, double angle) {
    return AngleAxisd(angle * (1.0 - 2.0 * depth), wall.col(2));
  };
  const Turn outwards = [](const MaterialAxes& wall, const MaterialAxes& axes, double, double angle) {
    return AngleAxisd(angle, axes.col(0).cross(wall.col(2)).normalized());
  };
  std::vector<ConsideredError> errors;
  for (const Turn& turn : {helix, slope, outwards})
    errors.push_back(turned_fibres(model, sigma_deg, turn));
  return errors;
}

std::vector<ConsideredError> geometry_errors(const ElasticModel& model, double sigma_mm) {
  if (sigma_mm == 0.0) return {};
  return {moved_wall(model, sigma_mm, [](double depth) { return 1.0 - depth; }),
          moved_wall(model, sigma_mm, [](double depth) { return depth; })};
}

std::vector<ConsideredMotion> considered_motions(ElasticModel& model, const ElasticState& state,
                                                 const std::vector<ConsideredError>& errors) {
  constexpr double step = 1e-3;  // of sigma, on each side
  std::vector<ConsideredMotion> motions;
  if (errors.empty()) return motions;
  const HeldDofs& held = model.system().held();
  std::vector<double> right_sides;
  for (const ConsideredError& error : errors) {
    ConsideredMotion& motion = motions.emplace_back();
    const auto residual_at = [&](double amount) {
      ElasticState moved = state;
      for (size_t dof = 0; dof < error.shape.size(); ++dof)
        if (held[dof]) moved.position_mm[dof] += amount * error.shape[dof];
      const ElasticModel with = error.with(model, amount);
      motion.stored_energy_mJ += std::copysign(0.5 / step, amount) * constrained_energy_mJ(with, moved);
      return with.system().residual(moved).values;
    };
    const std::vector<double> above = residual_at(step * error.sigma),
                              below = residual_at(-step * error.sigma);
    for (size_t n = 0; n < above.size(); ++n)
      right_sides.push_back(-(above[n] - below[n]) / (2.0 * step));
  }
  if (model.system().factorise(state).singular)
    throw std::domain_error("an equilibrium with a singular tangent has no derivatives");
  model.system().solve(right_sides, errors.size());
  const size_t unknowns = right_sides.size() / errors.size();
  for (size_t i = 0; i < errors.size(); ++i) {
    ConsideredMotion& motion = motions[i];
    motion.source = errors[i].source;
    motion.by_motion = model.system().node_field(std::span(right_sides).subspan(i * unknowns, unknowns));
    motion.stored_energy_mJ += pressure_work_mJ(model, state, motion.by_motion);
    motion.by_reference.assign(motion.by_motion.size(), 0.0);
    if (errors[i].shape.empty()) continue;
    add_scaled(motion.by_reference, errors[i].sigma, errors[i].shape);
    for (size_t dof = 0; dof < motion.by_motion.size(); ++dof)
      if (held[dof]) motion.by_motion[dof] = motion.by_reference[dof];
  }
  return motions;
}

}  // namespace diastole
