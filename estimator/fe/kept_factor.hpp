#pragma once
// Corrections with a factor that is kept while the state moves on: Broyden's "good" quasi-Newton method in its
// error-oriented form (P. Deuflhard, Newton Methods for Nonlinear Problems, 2004, section 2.1.4, QNERR). With
// d0 the step that the factor K was made for, and  s = - K^-1 r(x)  the simplified correction after step d_k,
//
//   v = s + sum_{i < k}  (v . d_i / |d_i|^2) d_{i+1}         one after the other
//   d_{k+1} = v / (1 - v . d_k / |d_k|^2)
//
// so that K learns from each step how the tangent has changed since, without being factorised again. A step that
// shrinks by less than a tenth, or the twentieth, asks for a new tangent (Deuflhard asks when one does not halve; but a
// step here costs a twentieth of a tangent, and after one slow step in the beginning the next ones are fast). After
// a first step as large as the whole body (size 1) the solution is far, and each must shrink fivefold: the beam of Land et al.
// takes 10 to 11 tangents so, and 21 otherwise.

#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace diastole {

class KeptFactor {
 public:
  /// The inner product of two vectors over the unknowns, without units: 1 is as large as the body and its pressures.
  using Product = std::function<double(std::span<const double>, std::span<const double>)>;

  KeptFactor(Product product, std::vector<double> first_step);

  /// The next step, given the simplified correction after the last one; nothing when a new tangent is due.
  [[nodiscard]] std::optional<std::vector<double>> next_step(std::vector<double> simplified);

 private:
  Product product_;
  std::vector<std::vector<double>> steps_;
  std::vector<double> squares_;  // of the steps' sizes
};

}  // namespace diastole
