#pragma once
// The drive nearest to a wanted one that keeps within bounds of volume, flow and acceleration at all times.
//
//   least |J (U - wanted)|^2   with   least <= u <= most, |u'| <= q, |u''| <= a(q)
//
// a convex programme for each peak flow q, solved by operator splitting (B. Stellato et al., OSQP, Math. Prog. Comp. 12 (2020) 637),
// and q by a scan: losses take from the pressure what inertia may use, so that a falls as q rises.

#include <functional>

#include "estimator/shaping/periodic_curve.hpp"

namespace diastole::shaping {

struct DriveBounds {
  double least_mL = 0.0;
  double most_mL = 0.0;
  double flow_mL_s = 0.0;                                           ///< of any motion
  std::function<double(double flow_mL_s)> acceleration_mL_s2 = {};  ///< beside that peak flow; 0: none
};

bool within(const PeriodicCurve& drive_mL, const DriveBounds& bounds);

/// `slope`: J, in numbers_of(). The drive itself where it is within.
PeriodicCurve nearest_within(const PeriodicCurve& drive_mL, const Eigen::MatrixXd& slope,
                             const DriveBounds& bounds);

}  // namespace diastole::shaping
