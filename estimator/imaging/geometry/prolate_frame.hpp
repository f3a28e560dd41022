#pragma once
// Prolate spheroidal coordinates about a ventricle's long axis, in which a ventricle's walls are nearly lambda = const
// (P. M. F. Nielsen et al., Am. J. Physiol. 260 (1991) H1365):
//
//      base  \    |z   /         x = d sinh(lambda) sin(mu) cos(theta)
//             \   |   /          y = d sinh(lambda) sin(mu) sin(theta)
//              |  +--|--> x      z = -d cosh(lambda) cos(mu)                 mu = 0 at the apex
//               \ |  /
//                \|_/  apex      scale factors: lambda, mu: h = d sqrt(sinh2(lambda) + sin2(mu));  theta: d sinh(lambda) sin(mu)
//
// Lengths in mm. Negative mu is the other side of the axis (theta + pi), so that surfaces are smooth across the apex.

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace diastole::imaging {

struct Prolate {
  double lambda = 0, mu = 0, theta = 0;
};

struct ProlateFrame {
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();  ///< in patient coordinates
  Eigen::Matrix3d axes =
      Eigen::Matrix3d::Identity();  ///< columns: x, y, z (from apex to base) in the patient
  double focus_mm = 1;              ///< d

  /// Patient coordinates to the axes' own, and back.
  [[nodiscard]] Eigen::Vector3d inside(const Eigen::Vector3d& patient_mm) const {
    return axes.transpose() * (patient_mm - origin_mm);
  }
  [[nodiscard]] Eigen::Vector3d patient(const Eigen::Vector3d& inside_mm) const {
    return origin_mm + axes * inside_mm;
  }

  [[nodiscard]] Prolate coordinates(const Eigen::Vector3d& inside_mm) const {
    const double radius = std::hypot(inside_mm.x(), inside_mm.y());
    const double below = std::hypot(radius, inside_mm.z() + focus_mm);
    const double above = std::hypot(radius, inside_mm.z() - focus_mm);
    return {std::acosh(std::max(1.0, (below + above) / (2 * focus_mm))),
            std::acos(std::clamp((above - below) / (2 * focus_mm), -1.0, 1.0)),
            std::atan2(inside_mm.y(), inside_mm.x())};
  }
  [[nodiscard]] Eigen::Vector3d place(const Prolate& at) const {
    const double radius = focus_mm * std::sinh(at.lambda) * std::sin(at.mu);
    return {radius * std::cos(at.theta), radius * std::sin(at.theta),
            -focus_mm * std::cosh(at.lambda) * std::cos(at.mu)};
  }
  /// h of lambda and mu.
  [[nodiscard]] double scale_mm(const Prolate& at) const {
    return focus_mm * std::hypot(std::sinh(at.lambda), std::sin(at.mu));
  }
  /// Columns: derivatives of the place with respect to lambda, mu and theta.
  [[nodiscard]] Eigen::Matrix3d tangents(const Prolate& at) const {
    const double sh = std::sinh(at.lambda), ch = std::cosh(at.lambda);
    const double s = std::sin(at.mu), c = std::cos(at.mu);
    const double ct = std::cos(at.theta), st = std::sin(at.theta);
    Eigen::Matrix3d t;
    t << ch * s * ct, sh * c * ct, -sh * s * st,  //
        ch * s * st, sh * c * st, sh * s * ct,    //
        -sh * c, ch * s, 0;
    return focus_mm * t;
  }
};

}  // namespace diastole::imaging
