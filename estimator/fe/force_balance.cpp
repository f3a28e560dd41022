#include "estimator/fe/force_balance.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace diastole {
namespace {

constexpr double N_per_mN = 1e-3;

Eigen::Vector3d force_on(const NodeField& forces_mN, size_t node) {
  return N_per_mN * Eigen::Vector3d(&forces_mN[dof_of(node, 0, 0)]);
}

Eigen::Vector3d resultant(const NodeField& forces_mN) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (size_t node = 0; node < forces_mN.size() / dofs_per_node; ++node)
    sum += force_on(forces_mN, node);
  return sum;
}

}  // namespace

ForceBalance force_balance(const ElasticSystem& system, const ElasticState& state) {
  const HermiteMesh& mesh = system.mesh();
  const ElasticSystem::NodalForces forces = system.nodal_forces(state);
  std::vector<unsigned char> counted(mesh.node_count(), 0);
  const auto held = [&](size_t node) {
    return std::any_of(&system.held()[dof_of(node, 0, 0)], &system.held()[dof_of(node, 0, 3)],
                       [](unsigned char flag) { return flag != 0; });
  };
  ForceBalance balance;
  const auto take = [&](SupportForce& support, size_t node) {
    if (std::exchange(counted[node], 1) == 0) support.force_N += force_on(forces.supports, node);
  };
  const MeshFaces& faces = mesh.faces();
  using Named = std::pair<std::string_view, const std::vector<ElementFace>*>;
  for (const auto& [name, listed] : std::array<Named, 4>{{{"bottom", &faces.bottom},
                                                          {"top", &faces.top},
                                                          {"left", &faces.left},
                                                          {"right", &faces.right}}}) {
    SupportForce support{name, Eigen::Vector3d::Zero()};
    bool supported = false;
    for (const ElementFace& face : *listed) {
      const std::array<size_t, 4> at = face_corners(face);
      const auto node = [&](size_t corner) { return mesh.element(face.element)[corner]; };
      if (!system.on_springs(face) &&
          !std::all_of(at.begin(), at.end(), [&](size_t corner) { return held(node(corner)); }))
        continue;
      supported = true;
      for (const size_t corner : at)
        take(support, node(corner));
    }
    if (supported) balance.supports.push_back(support);
  }
  SupportForce points{"points", Eigen::Vector3d::Zero()};
  bool pinned = false;
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    if (counted[node] != 0 || !held(node)) continue;
    pinned = true;
    take(points, node);
  }
  if (pinned) balance.supports.push_back(points);
  balance.cavity_N = resultant(forces.cavity);
  balance.chamber_N = resultant(forces.chamber);
  balance.unbalanced_N = balance.cavity_N + balance.chamber_N;
  for (const SupportForce& support : balance.supports)
    balance.unbalanced_N += support.force_N;
  return balance;
}

}  // namespace diastole
