#pragma once
// Equilibria of a body with a lump in it, on a mesh that is fine around the lump, and their derivatives by its parameters.
//
//   R(x; m) = 0,     dx/dm_i = - K^-1 dR/dm_i
//
// with m the stiffness from place to place: at a Gauss point the mean over the part of the element that it stands for, because a
// lump's edge is as sharp as Gauss points are apart, and what is only sampled there moves by leaps. The factor of K is kept while the lump changes little (decision 0071): Broyden's
// corrections (estimator/fe/kept_factor.hpp) find the equilibrium with it, and derivatives are right to the lump's change since.

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "estimator/effects/effect.hpp"
#include "estimator/explain/imaging/stiffness_sides.hpp"
#include "estimator/fe/elastic_model.hpp"

namespace diastole::explain {

constexpr size_t lump_parameters = 7;
using LumpValues = std::array<double, lump_parameters>;  ///< in the order of inclusion_effect()

Inclusion lump_with(const LumpValues& values, const FieldModel& body);

/// Elements around the lump: about as large as it (9,400 unknowns), or half of that (19,000).
enum class LumpMesh { coarse, fine };

class LumpBody {
 public:
  /// A neo-Hookean annulus with held ends at one cavity pressure. The mesh is fine around `lump`.
  LumpBody(const FieldModel& body, double C1_kPa, double pressure_kPa, const Inclusion& lump, LumpMesh mesh);

  [[nodiscard]] const HermiteMesh& mesh() const { return model_.mesh(); }
  /// Positions without a lump; none without an equilibrium.
  [[nodiscard]] const NodeField* plain_mm() const { return plain_ ? &plain_->position_mm : nullptr; }

  /// What the lump adds to the positions, and that by the parameters' search coordinates.
  struct Addition {
    NodeField position_mm;
    std::array<NodeField, lump_parameters> by;
  };
  /// None without an equilibrium. `exact`: derivatives by the tangent of this very equilibrium.
  [[nodiscard]] std::optional<Addition> addition(const LumpValues& values, bool exact = false);

 private:
  [[nodiscard]] bool factorise();
  [[nodiscard]] bool balance();
  [[nodiscard]] bool tangent_serves() const;
  [[nodiscard]] bool corrected_with_kept_factor();
  [[nodiscard]] std::array<NodeField, lump_parameters> slopes(const LumpValues& values);
  [[nodiscard]] GaussNumbers stiffness_of(const LumpValues& values) const;

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
  std::optional<ElasticState> plain_;  ///< without a lump; none: no equilibrium
  ElasticState state_;                 ///< of the last lump
  LumpValues wanted_{};
  std::optional<LumpValues> factored_;  ///< the lump whose tangent is kept,
  NodeField factored_mm_;               ///< and the positions at which it was taken
};

}  // namespace diastole::explain
