#pragma once
// A material law with values of its parameters, as a bench test sees it: the stress in the test's own axes for a given
// deformation, up to a pressure, and its derivatives by the parameters.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "estimator/materials/law.hpp"

namespace diastole {

class LawAt {
 public:
  enum class Slopes { left_out, given };

  /// One value for each of the law's parameters; they and the law must live as long.
  LawAt(const Law& law, std::span<const double> values, Slopes slopes)
      : law_(law), values_(values), slopes_(slopes) {}

  /// Of all that is made of stresses: the quantity itself, and with slopes its derivative by each parameter after it.
  [[nodiscard]] size_t parts() const { return slopes_ == Slopes::given ? 1 + values_.size() : 1; }
  [[nodiscard]] LawAt without_slopes() const { return {law_, values_, Slopes::left_out}; }
  [[nodiscard]] bool needs_axes() const { return law_.needs_axes(); }

  /// Cauchy stress F S F^T (kPa) but for a pressure, [0], and its derivatives, [1...]. Precondition: det F = 1. The fibre lies
  /// in the plane of the first two axes, turned by so much from the first one to the second; the third is the sheet's normal.
  [[nodiscard]] std::vector<Eigen::Matrix3d> stress(const Eigen::Matrix3d& deformation_gradient,
                                                    double fibre_rad) const;

 private:
  const Law& law_;
  std::span<const double> values_;
  Slopes slopes_;
};

}  // namespace diastole
