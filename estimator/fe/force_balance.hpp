#pragma once
// The forces on the whole body at an equilibrium: what the supports exert, and what the fluids do.
//
//   supports + cavity + chamber = 0
//
// up to what Newton's method left at free nodes (`unbalanced_N`). A face's force is the sum over its nodes' values:
// the value functions add up to one, so that the other dofs carry moments only. A face is supported where it is on
// springs or all its corners are held; a node on two such faces counts for the first of bottom, top, left, right.
// Forces in N.

#include <Eigen/Dense>
#include <string_view>
#include <vector>

#include "estimator/fe/elastic_system.hpp"

namespace diastole {

struct SupportForce {
  std::string_view face;  ///< "bottom", "top", "left", "right"; "points" for nodes held elsewhere
  Eigen::Vector3d force_N;
};

struct ForceBalance {
  std::vector<SupportForce> supports;  ///< of plates, pins and springs on the body; only those that exist
  Eigen::Vector3d cavity_N;            ///< resultant of the cavity's pressure on the body
  Eigen::Vector3d chamber_N;           ///< of the pressure around the specimen
  Eigen::Vector3d unbalanced_N;        ///< sum of all the above
};

ForceBalance force_balance(const ElasticSystem& system, const ElasticState& state);

}  // namespace diastole
