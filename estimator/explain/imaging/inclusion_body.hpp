#pragma once
// Equilibria of a body with an inclusion in it, on a mesh that is fine around the inclusion, and their derivatives by its parameters.
//
//   R(x; m) = 0,     dx/dm_i = - K^-1 dR/dm_i
//
// with m the stiffness from place to place: at a Gauss point the mean over the part of the element that it stands for, because an
// inclusion's edge is as sharp as Gauss points are apart, and what is only sampled there moves by leaps. The factor of K is kept while the inclusion changes little (decision 0071): Broyden's
// corrections (estimator/fe/kept_factor.hpp) find the equilibrium with it, and derivatives are right to the inclusion's change since.

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "estimator/effects/effect.hpp"
#include "estimator/explain/imaging/stiffness_sides.hpp"
#include "estimator/fe/elastic_model.hpp"

namespace diastole::explain {

constexpr size_t inclusion_parameters = 7;                         ///< a logarithmic contrast first
using InclusionValues = std::array<double, inclusion_parameters>;  ///< in the order of inclusion_effect()

Inclusion inclusion_with(const InclusionValues& values, const FieldModel& body);

/// Elements around the inclusion: about as large as it (9,400 unknowns), or half of that (19,000).
enum class InclusionMesh { coarse, fine };

class InclusionBody {
 public:
  /// A neo-Hookean annulus with held ends at one cavity pressure. The mesh is fine around `inclusion`.
  InclusionBody(const FieldModel& body, double C1_kPa, double pressure_kPa, const Inclusion& inclusion,
                InclusionMesh mesh);

  [[nodiscard]] const HermiteMesh& mesh() const { return model_.mesh(); }
  /// Positions without an inclusion; none without an equilibrium.
  [[nodiscard]] const NodeField* plain_mm() const { return plain_ ? &plain_->position_mm : nullptr; }

  /// What the inclusion adds to the positions, and then that by each of the parameters' search coordinates.
  using Addition = std::array<NodeField, 1 + inclusion_parameters>;
  /// None without an equilibrium. `exact`: derivatives by the tangent of this very equilibrium.
  [[nodiscard]] std::optional<Addition> addition(const InclusionValues& values, bool exact = false);

 private:
  [[nodiscard]] bool factorise();
  [[nodiscard]] bool balance();
  [[nodiscard]] bool tangent_serves() const;
  [[nodiscard]] bool corrected_with_kept_factor();
  void add_slopes(const InclusionValues& values, Addition& result);
  [[nodiscard]] GaussNumbers stiffness_of(const InclusionValues& values) const;

  /// Where the stiffness is asked for: the parts of an element's volume that its Gauss points stand for, sampled evenly.
  struct Samples {
    Eigen::Vector3d middle_mm;
    double reach_mm;
    std::vector<Eigen::Vector3d> X_mm;
  };
  [[nodiscard]] static std::vector<Samples> samples_of(const HermiteMesh& mesh);

  FieldModel body_;
  ElasticModel model_;
  std::vector<Samples> samples_;
  std::optional<ElasticState> plain_;  ///< without an inclusion; none: no equilibrium
  ElasticState state_;                 ///< of the last inclusion
  InclusionValues wanted_{};
  std::optional<InclusionValues> factored_;  ///< the inclusion whose tangent is kept,
  NodeField factored_mm_;                    ///< and the positions at which it was taken
};

}  // namespace diastole::explain
