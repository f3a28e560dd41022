#pragma once
// Equilibria of a specimen with field effects (estimator/effects/field_model.hpp), and their exact derivatives.
//
// The mesh's topology is fixed; the model, its inner radius included, may change between solutions, each of which
// starts from the displacements of the last one. A derivative with respect to anything in the model comes from the
// residual's central difference at the fixed displacement and one back-substitution:
//
//   du/dm = - K^-1 (R(u; m + h) - R(u; m - h)) / 2h
//
// Units: mm, kPa.

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "estimator/effects/field_model.hpp"
#include "estimator/fe/elastic_model.hpp"
#include "estimator/fe/elastic_system.hpp"
#include "estimator/mesh/point_locator.hpp"
#include "estimator/model/inclusion_stiffness.hpp"

namespace diastole::explain {

/// A direction in which the model may change, by the models on both sides of it.
struct FieldPerturbation {
  FieldModel up;
  FieldModel down;
  double width = 0.0;  ///< between them, in the parameter's coordinate
};

/// K^-1 applied to each of these right-hand sides over the unknowns, as displacement fields; the tangent is that of an
/// equilibrium.
std::vector<NodeField> responses(ElasticModel& body, const ElasticState& state,
                                 const std::vector<std::vector<double>>& right_sides);

class FieldSolver {
 public:
  FieldSolver(std::array<size_t, 3> elements, LocatorOptions locator)
      : elements_(elements), locator_(locator) {}

  void set(const FieldModel& model, double C1_kPa);
  /// Equilibrium at a cavity pressure, kept under the slot's number; false if none was found.
  bool solve(size_t slot, double pressure_kPa);

  [[nodiscard]] const HermiteMesh& mesh() const { return elastic_->mesh(); }
  /// Of the undeformed mesh.
  [[nodiscard]] const PointLocator& reference() const { return *reference_; }
  [[nodiscard]] NodeField displacement_mm(size_t slot) const;
  /// As images show it.
  [[nodiscard]] NodeField seen_displacement_mm(size_t slot) const;

  /// Derivatives of seen_displacement_mm at the slot's solution.
  struct Slopes {
    NodeField modulus;  ///< by C1
    std::vector<NodeField> model;
  };
  [[nodiscard]] Slopes slopes(size_t slot, const std::vector<FieldPerturbation>& perturbations);
  /// Of the undeformed mesh by a perturbation; empty where it stays.
  [[nodiscard]] NodeField reference_slope(const FieldPerturbation& perturbation) const;

  /// The same of the slot's solution.
  [[nodiscard]] std::vector<NodeField> responses(size_t slot,
                                                 const std::vector<std::vector<double>>& right_sides) {
    return explain::responses(*elastic_, state(slot), right_sides);
  }

  [[nodiscard]] ElasticModel& elastic() { return *elastic_; }
  [[nodiscard]] const ElasticState& state(size_t slot) const { return states_[slot].value(); }

 private:
  [[nodiscard]] std::unique_ptr<ElasticModel> build(const FieldModel& model) const;
  [[nodiscard]] ElasticState carried_over(const ElasticState& state, const HermiteMesh& from) const;
  [[nodiscard]] std::vector<double> residual_of(const FieldModel& model, const ElasticState& state) const;

  std::array<size_t, 3> elements_;
  LocatorOptions locator_;
  FieldModel model_;
  double C1_kPa_ = 1.0;
  std::unique_ptr<ElasticModel> elastic_;
  std::unique_ptr<PointLocator> reference_;
  std::vector<std::optional<ElasticState>> states_;
};

// How forces answer to the stiffness: right-hand sides for a body's tangent.

/// The field's values at the Gauss points.
GaussNumbers at_gauss_points(const HermiteMesh& mesh,
                             const std::function<double(const MaterialPoint&)>& field);

/// - dR/dc for an energy W(X) (1 + c field(X)), one for each field, over the system's unknowns.
std::vector<std::vector<double>> stiffness_sides(const ElasticSystem& system, const ElasticState& state,
                                                 const std::vector<GaussNumbers>& fields);

}  // namespace diastole::explain
