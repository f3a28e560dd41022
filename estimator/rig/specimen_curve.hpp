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

/// In what a neighbour of the specimen differs from it.
enum class Difference {
  inner_radius,  ///< larger by this part, within +-0.1
  stiffening,    ///< W = C1/beta (exp(beta (I1 - 3)) - 1), beta in [0, 3]
  end_slip  ///< plates hold the ends along the axis; across it they yield by this compliance times C1, mm
};

/// What the rig asks of its specimen: the curve, and those of specimens that differ from it by one value. All at a
/// modulus of 1 kPa. SpecimenFamily (estimator/model/specimen_family.hpp) solves for them.
class SpecimenCurves {
 public:
  virtual ~SpecimenCurves() = default;

  /// Of the specimen itself.
  [[nodiscard]] virtual const SpecimenCurve& plain() const = 0;
  /// Neighbours exist for a cylinder of neo-Hookean material.
  [[nodiscard]] virtual bool has_neighbours() const = 0;

  /// Another value of one quantity. `low_fidelity`: how the neighbour differs is taken from the coarse mesh alone, which
  /// gives it within some percent at once.
  [[nodiscard]] virtual SpecimenCurve neighbour(Difference what, double value, bool low_fidelity) const = 0;
};

}  // namespace diastole::rig
