#pragma once
// A specimen's pressure-volume curve as a smooth function: cubic Hermite pieces through equilibria, with their exact
// slopes. Beyond the ends it goes on straight.

#include <vector>

namespace diastole::rig {

class SpecimenCurve {
 public:
  struct Point {
    double volume_mL = 0.0;  ///< taken since rest
    double pressure_kPa = 0.0;
    double stiffness_kPa_per_mL = 0.0;
  };
  struct Value {
    double pressure_kPa = 0.0;
    double stiffness_kPa_per_mL = 0.0;
  };

  SpecimenCurve() = default;
  /// Precondition: two points or more, volumes strictly increasing and evenly spaced.
  explicit SpecimenCurve(std::vector<Point> points);

  [[nodiscard]] Value at(double volume_mL) const;
  [[nodiscard]] const std::vector<Point>& points() const { return points_; }
  /// The curve times `factor` plus `other` times its factor, at this curve's volumes.
  [[nodiscard]] SpecimenCurve plus(const SpecimenCurve& other, double factor, double other_factor) const;

 private:
  std::vector<Point> points_;
  double spacing_mL_ = 1.0;
  double per_mL_ = 1.0;
};

}  // namespace diastole::rig
