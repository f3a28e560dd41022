#pragma once
// Equilibria of a body with a lump in it, on a mesh that is fine around the lump, and their derivatives by its parameters.
//
//   R(x; m) = 0,     dx/dm_i = - K^-1 dR/dm_i
//
// with m the stiffness from place to place. The factor of K is kept while the lump changes little (decision 0090): Broyden's
// corrections (estimator/fe/kept_factor.hpp) find the equilibrium with it, and derivatives are right to the lump's change since.

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "estimator/effects/effect.hpp"
#include "estimator/fe/elastic_model.hpp"

namespace diastole::explain {

constexpr size_t lump_parameters = 7;
using LumpValues = std::array<double, lump_parameters>;  ///< in the order of the effect `stiff-inclusion`

const Effect& lump_effect();
Inclusion lump_with(const LumpValues& values, const FieldModel& body);

class LumpBody {
 public:
  /// A neo-Hookean annulus with held ends at one cavity pressure. The mesh is fine around `lump`.
  LumpBody(const FieldModel& body, double C1_kPa, double pressure_kPa, const Inclusion& lump);

  [[nodiscard]] const HermiteMesh& mesh() const { return model_.mesh(); }

  /// What the lump adds to the positions, and that by the parameters' search coordinates.
  struct Addition {
    NodeField position_mm;
    std::array<NodeField, lump_parameters> by;
  };
  /// None without an equilibrium.
  [[nodiscard]] std::optional<Addition> addition(const LumpValues& values);

 private:
  [[nodiscard]] bool factorise();
  [[nodiscard]] bool balance();
  [[nodiscard]] bool corrected_with_kept_factor();
  [[nodiscard]] std::array<NodeField, lump_parameters> slopes(const LumpValues& values);

  FieldModel body_;
  ElasticModel model_;
  std::optional<ElasticState> plain_;  ///< without a lump; none: no equilibrium
  ElasticState state_;                 ///< of the last lump
  LumpValues wanted_{};
  std::optional<LumpValues> factored_;  ///< the lump whose tangent is kept
};

}  // namespace diastole::explain
