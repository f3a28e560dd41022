#include "estimator/rig/specimen_curve.hpp"

#include <algorithm>
#include <utility>

namespace diastole::rig {

SpecimenCurve::SpecimenCurve(std::vector<Point> points)
    : points_(std::move(points)),
      spacing_mL_(points_[1].volume_mL - points_[0].volume_mL),
      per_mL_(1.0 / spacing_mL_) {}

SpecimenCurve::Value SpecimenCurve::at(double volume_mL) const {
  const double place = (volume_mL - points_.front().volume_mL) * per_mL_;
  const double last = static_cast<double>(points_.size() - 2);
  // Not a number, as of a simulation that diverged, is found in the first interval, and stays none.
  const Point& left = points_[static_cast<size_t>(place > 0.0 ? std::min(place, last) : 0.0)];
  const Point& right = *(&left + 1);
  const double s = (volume_mL - left.volume_mL) * per_mL_;
  if (s < 0.0)
    return {left.pressure_kPa + s * spacing_mL_ * left.stiffness_kPa_per_mL, left.stiffness_kPa_per_mL};
  if (s > 1.0) {
    return {right.pressure_kPa + (s - 1.0) * spacing_mL_ * right.stiffness_kPa_per_mL,
            right.stiffness_kPa_per_mL};
  }
  const double rise = right.pressure_kPa - left.pressure_kPa;
  const double m0 = left.stiffness_kPa_per_mL * spacing_mL_;
  const double m1 = right.stiffness_kPa_per_mL * spacing_mL_;
  const double c2 = 3.0 * rise - 2.0 * m0 - m1;
  const double c3 = m0 + m1 - 2.0 * rise;
  return {left.pressure_kPa + s * (m0 + s * (c2 + s * c3)), (m0 + s * (2.0 * c2 + 3.0 * s * c3)) * per_mL_};
}

SpecimenCurve SpecimenCurve::plus(const SpecimenCurve& other, double factor, double other_factor) const {
  std::vector<Point> points = points_;
  for (Point& point : points) {
    const Value more = other.at(point.volume_mL);
    point.pressure_kPa = factor * point.pressure_kPa + other_factor * more.pressure_kPa;
    point.stiffness_kPa_per_mL =
        factor * point.stiffness_kPa_per_mL + other_factor * more.stiffness_kPa_per_mL;
  }
  return SpecimenCurve(std::move(points));
}

}  // namespace diastole::rig
