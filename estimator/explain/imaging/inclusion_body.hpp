#pragma once
// Equilibria of a body with an inclusion in it, on a mesh that is fine around the inclusion, and their derivatives by its parameters.
//
//   R(x; m) = 0,     dx/dm_i = - K^-1 dR/dm_i
//
// with m the stiffness from place to place (inclusion_stiffness.hpp). The factor of K is kept while the inclusion changes little (decision 0071): Broyden's
// corrections (estimator/fe/kept_factor.hpp) find the equilibrium with it, and derivatives are right to the inclusion's change since.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "estimator/effects/effect.hpp"
#include "estimator/explain/imaging/field_fit.hpp"
#include "estimator/explain/imaging/field_solver.hpp"
#include "estimator/fe/elastic_model.hpp"
#include "estimator/fe/elastic_system.hpp"
#include "estimator/fe/kept_factor.hpp"
#include "estimator/mesh/annulus.hpp"
#include "estimator/mesh/node_field.hpp"
#include "estimator/model/inclusion_stiffness.hpp"

namespace diastole::explain {

constexpr size_t inclusion_parameters = 7;                         ///< a logarithmic contrast first
using InclusionValues = std::array<double, inclusion_parameters>;  ///< in the order of inclusion_effect()

inline Inclusion inclusion_with(const InclusionValues& values, const FieldModel& body) {
  FieldModel model = body;
  inclusion_effect().apply_to_field(values, model);
  return model.inclusion.value_or(Inclusion{.semi_axes_mm = {1.0, 1.0, 1.0}});
}

/// Elements around the inclusion: about as large as it (9,400 unknowns), or half of that (19,000).
enum class InclusionMesh { coarse, fine };

class InclusionBody {
 public:
  /// A neo-Hookean annulus with held ends at one cavity pressure. The mesh is fine around `inclusion`.
  InclusionBody(const FieldModel& body, double C1_kPa, double pressure_kPa, const Inclusion& inclusion,
                InclusionMesh mesh)
      : body_(body), model_(model_around(body, C1_kPa, inclusion, mesh)), stiffness_(model_.mesh()) {
    Solution solution = model_.solve(pressure_kPa);
    if (!solution.report.converged()) return;
    state_ = solution.state;
    plain_ = std::move(solution.state);
  }

  [[nodiscard]] const HermiteMesh& mesh() const { return model_.mesh(); }
  /// Positions without an inclusion; none without an equilibrium.
  [[nodiscard]] const NodeField* plain_mm() const { return plain_ ? &plain_->position_mm : nullptr; }

  /// What the inclusion adds to the positions, and then that by each of the parameters' search coordinates.
  using Addition = std::array<NodeField, 1 + inclusion_parameters>;
  /// None without an equilibrium. `exact`: derivatives by the tangent of this very equilibrium.
  [[nodiscard]] std::optional<Addition> addition(const InclusionValues& values, bool exact = false) {
    if (!plain_) return {};
    wanted_ = values;
    const GaussNumbers stiffness = stiffness_of(values);
    for (size_t e = 0; e < stiffness.size(); ++e)
      model_.system().set_stiffness(e, stiffness[e]);
    if (!balance() || ((exact || !tangent_serves()) && !factorise())) {
      state_ = *plain_;
      factored_.reset();
      return {};
    }
    Addition result{difference(state_.position_mm, plain_->position_mm)};
    add_slopes(values, result);
    return result;
  }

 private:
  /// Where the last correction is smaller the equilibrium is found: a thousandth of a tag's error.
  static constexpr double balanced_mm = 1e-4;
  /// By how much an inclusion's parameters may differ from those for which the tangent was factorised.
  static constexpr double kept_ratio = 0.25;
  static constexpr double kept_mm = 1.0;
  static constexpr double kept_deg = 1.5;
  /// By how much of what an inclusion does the body may have moved since.
  static constexpr double kept_share = 0.3;

  /// Levels at both ends, near the plates, and at these distances from a centre; gaps of more than 20 mm are halved.
  static std::vector<double> levels_around(double half_height_mm, double centre_mm,
                                           std::span<const double> distances_mm, double too_close_mm) {
    constexpr double plate_mm = 7.0;
    constexpr double gap_mm = 20.0;
    std::vector<double> wanted{-half_height_mm, half_height_mm, plate_mm - half_height_mm,
                               half_height_mm - plate_mm};
    for (const double distance_mm : distances_mm) {
      const double level_mm = centre_mm + distance_mm;
      const bool apart = std::ranges::all_of(
          wanted, [&](double other) { return std::abs(other - level_mm) > too_close_mm; });
      if (std::abs(level_mm) < half_height_mm && apart) wanted.push_back(level_mm);
    }
    std::ranges::sort(wanted);
    std::vector<double> levels{wanted.front()};
    for (size_t i = 1; i < wanted.size(); ++i) {
      if (wanted[i] - wanted[i - 1] > gap_mm) levels.push_back(0.5 * (wanted[i] + wanted[i - 1]));
      levels.push_back(wanted[i]);
    }
    return levels;
  }

  /// Parts of the wall around an inclusion's depth.
  static std::vector<double> radii_around(const FieldModel& body, double centre_mm, InclusionMesh mesh) {
    const double inner_mm = body.inner_radius_mm;
    const double wall_mm = body.outer_radius_mm - inner_mm;
    const auto within = [&](double radius_mm, double least, double most) {
      return std::clamp(radius_mm, inner_mm + least * wall_mm, inner_mm + most * wall_mm);
    };
    if (mesh == InclusionMesh::coarse)
      return {inner_mm, within(centre_mm - 6.0, 0.2, 0.45), within(centre_mm + 6.0, 0.55, 0.8),
              body.outer_radius_mm};
    return {inner_mm, within(centre_mm - 7.0, 0.18, 0.33), within(centre_mm, 0.42, 0.58),
            within(centre_mm + 7.0, 0.67, 0.82), body.outer_radius_mm};
  }

  static HermiteMesh mesh_around(const FieldModel& body, const Inclusion& inclusion, InclusionMesh mesh) {
    static constexpr std::array<double, 10> coarse_deg{-115, -70, -36, -16, 0, 16, 36, 70, 115, 180};
    static constexpr std::array<double, 12> fine_deg{-110, -65, -34, -18, -9, 0, 9, 18, 34, 65, 110, 180};
    static constexpr std::array<double, 3> coarse_mm{0, -11, 11};
    static constexpr std::array<double, 5> fine_mm{0, -6.5, 6.5, -13, 13};
    const bool is_fine = mesh == InclusionMesh::fine;
    AnnulusGrid grid;
    for (const double offset_deg : is_fine ? std::span<const double>(fine_deg) : coarse_deg)
      grid.angles_deg.push_back(inclusion.theta_deg + offset_deg);
    grid.heights_mm =
        levels_around(0.5 * body.height_mm, inclusion.z_mm,
                      is_fine ? std::span<const double>(fine_mm) : coarse_mm, is_fine ? 3.0 : 5.0);
    grid.radii_mm = radii_around(body, inclusion.radius_mm, mesh);
    return make_annulus_on(grid);
  }

  static ElasticModel model_around(const FieldModel& body, double C1_kPa, const Inclusion& inclusion,
                                   InclusionMesh mesh) {
    ElasticOptions options;
    options.parameters = {C1_kPa};
    return {mesh_around(body, inclusion, mesh), *find_law("neo-hookean"), std::move(options)};
  }

  static inference::Parameter parameter(size_t i) {
    return searched(inclusion_effect().field_parameters()[i]);
  }

  /// Whether a tangent of one inclusion still serves for the other.
  static bool alike(const InclusionValues& a, const InclusionValues& b) {
    for (size_t i = 0; i < inclusion_parameters; ++i) {
      const inference::Parameter of = parameter(i);
      const double most = of.scale == inference::Scale::logarithmic ? kept_ratio
                          : of.unit == "deg"                        ? kept_deg
                                                                    : kept_mm;
      if (std::abs(of.coordinate(a[i]) - of.coordinate(b[i])) > most) return false;
    }
    return true;
  }

  static double largest(const NodeField& field) {
    double most = 0.0;
    for (const double value : field)
      most = std::isfinite(value) ? std::max(most, std::abs(value)) : HUGE_VAL;
    return most;
  }

  [[nodiscard]] bool factorise() {
    factored_.reset();
    if (model_.system().factorise(state_).singular) return false;
    factored_ = wanted_;
    factored_mm_ = state_.position_mm;
    return true;
  }
  /// Equilibrium from the last one.
  [[nodiscard]] bool balance() {
    if (!factored_ || !alike(*factored_, wanted_)) {
      if (!factorise()) return false;
    }
    if (corrected_with_kept_factor()) return true;
    state_ = *plain_;
    return factorise() && corrected_with_kept_factor();
  }
  /// Whether the body has moved little since, beside what the inclusion moves it.
  [[nodiscard]] bool tangent_serves() const {
    double since_mm = 0.0;
    double by_inclusion_mm = 0.0;
    for (size_t dof = 0; dof < factored_mm_.size(); ++dof) {
      since_mm = std::max(since_mm, std::abs(state_.position_mm[dof] - factored_mm_[dof]));
      by_inclusion_mm =
          std::max(by_inclusion_mm, std::abs(state_.position_mm[dof] - plain_->position_mm[dof]));
    }
    return since_mm < kept_share * by_inclusion_mm;
  }
  [[nodiscard]] bool corrected_with_kept_factor() {
    ElasticSystem& system = model_.system();
    const size_t displacements = system.equations().displacement_unknowns();
    const auto product = [&](std::span<const double> a, std::span<const double> b) {
      double sum = 0.0;
      for (size_t i = 0; i < displacements; ++i)
        sum += a[i] * b[i];
      return sum / (static_cast<double>(displacements) * body_.outer_radius_mm * body_.outer_radius_mm);
    };
    const auto correction = [&] {
      std::vector<double> step = system.residual(state_).values;
      system.solve(step);
      for (double& value : step)
        value = -value;
      return step;
    };
    std::optional<std::vector<double>> step = correction();
    KeptFactor kept(product, *step);
    while (step) {
      const double size_mm = largest(system.node_field(*step));
      if (!std::isfinite(size_mm)) return false;
      state_ = system.moved(state_, *step, 1.0);
      if (size_mm < balanced_mm) return true;
      step = kept.next_step(correction());
    }
    return false;
  }
  void add_slopes(const InclusionValues& values, Addition& result) {
    std::vector<GaussNumbers> fields;
    for (size_t i = 0; i < inclusion_parameters; ++i) {
      const inference::Parameter of = parameter(i);
      const double h = of.scale == inference::Scale::logarithmic ? 1e-3 : 1e-2;
      const auto stiffness = [&](double change) {
        InclusionValues changed = values;
        changed[i] = of.value(of.coordinate(values[i]) + change);
        return stiffness_of(changed);
      };
      GaussNumbers& slope = fields.emplace_back(stiffness(h));
      const GaussNumbers below = stiffness(-h);
      for (size_t e = 0; e < slope.size(); ++e)
        for (size_t q = 0; q < gauss_points; ++q)
          slope[e][q] = (slope[e][q] - below[e][q]) / (2.0 * h);
    }
    ElasticSystem& system = model_.system();
    std::vector<double> sides;
    for (const std::vector<double>& side : stiffness_sides(system, state_, fields))
      sides.insert(sides.end(), side.begin(), side.end());
    system.solve(sides, inclusion_parameters);
    for (size_t i = 0; i < inclusion_parameters; ++i)
      result[1 + i] = system.node_field(std::span(sides).subspan(i * model_.dofs(), model_.dofs()));
  }
  [[nodiscard]] GaussNumbers stiffness_of(const InclusionValues& values) const {
    return stiffness_.of(inclusion_with(values, body_));
  }

  FieldModel body_;
  ElasticModel model_;
  InclusionStiffness stiffness_;
  std::optional<ElasticState> plain_;  ///< without an inclusion; none: no equilibrium
  ElasticState state_;                 ///< of the last inclusion
  InclusionValues wanted_{};
  std::optional<InclusionValues> factored_;  ///< the inclusion whose tangent is kept,
  NodeField factored_mm_;                    ///< and the positions at which it was taken
};

}  // namespace diastole::explain
