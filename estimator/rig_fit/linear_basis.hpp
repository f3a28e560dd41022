#pragma once
// What columns span.

#include <Eigen/Core>

namespace diastole::rig {

inline constexpr double dependent = 1e-6;  ///< of a column's size: what is left of it is rounding

/// An orthonormal basis of the columns' span; columns that depend on others are left out.
Eigen::MatrixXd basis_of(const Eigen::MatrixXd& columns);

}  // namespace diastole::rig
