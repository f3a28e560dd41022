#pragma once
// The stress-free shape of a body that was imaged under load: which undeformed positions X make the imaged positions x the
// equilibrium at the pressure P of the imaging?
//
//   r(x, p; X, P) = 0   solved for X at free dofs and for the Lagrange pressures p, x being known       (inverse design:
//   Govindjee and Mihalic, Comput. Methods Appl. Mech. Engrg. 136 (1996) 47)
//
// by Newton's method with the exact derivative by X (reference_tangent.hpp), in adaptive steps of P from 0, where X = x.
// Held dofs of X are those of x. Fibres are material: they are known in the imaged body, and F^-1 carries them back.
// There may be no such shape: elements fold, or Newton's method stalls however small the load step; that is an outcome.
//
//   InverseDesign inverse(imaged.system());                        // a model whose mesh is the body as it was imaged
//   UnloadedShape shape = inverse.solve(1.2);
//   if (shape.report.converged()) { ElasticModel model = on_unloaded(imaged.system(), shape.reference_mm); model.solve(1.2) ... }
//
// Not for bodies on springs, in a chamber or of a stiffness that varies with the place, whose undeformed state is known otherwise.
// Units: mm, kPa.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/fe/reference_tangent.hpp"
#include "estimator/fe/sparse_factor.hpp"

namespace diastole {

struct UnloadReport {
  SolveReason reason = SolveReason::converged;
  double reached_pressure_kPa = 0.0;  ///< of the last shape found on the way
  size_t load_steps = 0;
  size_t iterations = 0;                ///< of Newton's method, in all attempts
  std::optional<InvertedPlace> folded;  ///< with its place in the imaged body
  std::optional<size_t> beyond_law;     ///< the element

  [[nodiscard]] bool converged() const { return reason == SolveReason::converged; }
  [[nodiscard]] std::string describe() const;
};

struct UnloadedShape {
  NodeField reference_mm;  ///< X; when the report says failure, that of the pressure that was reached
  ElasticState imaged;     ///< x with its Lagrange pressures, at that pressure: an equilibrium of the body X
  UnloadReport report;
};

class InverseDesign {
 public:
  /// `imaged` must outlive it; its parameters may change between calls.
  explicit InverseDesign(const ElasticSystem& imaged);

  /// From the imaged shape at no load, or from an earlier solution of any pressure and parameters.
  [[nodiscard]] UnloadedShape solve(double pressure_kPa, const UnloadedShape* start = nullptr,
                                    const SolveOptions& options = {});

  struct Derivatives {
    std::vector<NodeField> by_parameter;  ///< dX/d(parameter) at fixed imaged positions, one for each group
    NodeField by_pressure;                ///< dX/dP, mm/kPa
  };
  /// Exact, at a converged shape. Throws std::domain_error where the derivative by X is singular.
  [[nodiscard]] Derivatives derivatives(const UnloadedShape& at, std::span<const ParameterGroup> groups);

  /// d(residual)/dX of the body X at any state of it, times fields of dX: a column over the unknowns for each, added to
  /// `target`.
  void add_reference_residual(const NodeField& reference_mm, const ElasticState& state,
                              std::span<const NodeField> changes, std::span<double> target) const;

 private:
  struct Attempt;

  Attempt attempt(UnloadedShape guess, const SolveOptions& options);
  [[nodiscard]] SystemResidual residual(const UnloadedShape& at) const;
  bool factorise(const UnloadedShape& at);
  void number_entries();

  const ElasticSystem& imaged_;
  std::vector<double> area_;  // of the cavity's wall, dr/dP = -area
  std::vector<int> rows_, columns_;
  std::optional<SparseFactor> factor_;
};

/// A model of the same law, parameters and supports on another body or with other fibres. Not for springs, chambers, a varying stiffness.
ElasticModel alike(const ElasticSystem& system, HermiteMesh mesh, MaterialAxesField axes,
                   SolveOptions options = {});

/// The model of the unloaded body: the imaged one's law, parameters and supports, fibres carried back.
ElasticModel on_unloaded(const ElasticSystem& imaged, NodeField reference_mm, SolveOptions options = {});

/// Whether the way back exists: the unloaded body, inflated from rest to the pressure of the imaging.
struct UnloadReturn {
  SolveReport report;
  double farthest_mm =
      0.0;  ///< from the imaged positions, over 27 places an element; of the state that was reached

  /// Whether the load brings the image back: to 1e-4 of the body's extent, in an equilibrium that is stable as far as this is known.
  [[nodiscard]] bool returned(const HermiteMesh& imaged) const;
};
UnloadReturn inflate_again(ElasticModel& unloaded, const HermiteMesh& imaged, double pressure_kPa);

}  // namespace diastole
