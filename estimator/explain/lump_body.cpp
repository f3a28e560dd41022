#include "estimator/explain/lump_body.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/explain/field_fit.hpp"
#include "estimator/explain/stiffness_sides.hpp"
#include "estimator/fe/elastic_system.hpp"
#include "estimator/fe/kept_factor.hpp"
#include "estimator/mesh/annulus_grid.hpp"

namespace diastole::explain {
namespace {

/// Where the last correction is smaller the equilibrium is found: a thousandth of a tag's error.
constexpr double balanced_mm = 1e-4;
/// By how much a lump's parameters may differ from those for which the tangent was factorised.
constexpr double kept_ratio = 0.25;
constexpr double kept_mm = 1.0;
constexpr double kept_deg = 1.5;

/// Levels at both ends and around a centre, gaps of more than 20 mm halved.
std::vector<double> levels_around(double low_mm, double high_mm, double centre_mm) {
  constexpr double lump_mm = 11.0;
  constexpr double plate_mm = 7.0;
  constexpr double gap_mm = 20.0;
  constexpr double too_close_mm = 5.0;
  std::vector<double> wanted{low_mm, high_mm, low_mm + plate_mm, high_mm - plate_mm};
  for (const double level_mm : {centre_mm, centre_mm - lump_mm, centre_mm + lump_mm}) {
    const bool apart =
        std::ranges::all_of(wanted, [&](double other) { return std::abs(other - level_mm) > too_close_mm; });
    if (level_mm > low_mm && level_mm < high_mm && apart) wanted.push_back(level_mm);
  }
  std::ranges::sort(wanted);
  std::vector<double> levels{wanted.front()};
  for (size_t i = 1; i < wanted.size(); ++i) {
    if (wanted[i] - wanted[i - 1] > gap_mm) levels.push_back(0.5 * (wanted[i] + wanted[i - 1]));
    levels.push_back(wanted[i]);
  }
  return levels;
}

HermiteMesh mesh_around(const FieldModel& body, const Inclusion& lump) {
  AnnulusGrid grid;
  for (const double offset_deg : {-115.0, -70.0, -36.0, -16.0, 0.0, 16.0, 36.0, 70.0, 115.0, 180.0})
    grid.angles_deg.push_back(lump.theta_deg + offset_deg);
  grid.heights_mm = levels_around(-0.5 * body.height_mm, 0.5 * body.height_mm, lump.z_mm);
  const double wall_mm = body.outer_radius_mm - body.inner_radius_mm;
  constexpr double half_lump_mm = 6.0;
  const double inner_mm = body.inner_radius_mm;
  grid.radii_mm = {
      inner_mm,
      std::clamp(lump.radius_mm - half_lump_mm, inner_mm + 0.2 * wall_mm, inner_mm + 0.45 * wall_mm),
      std::clamp(lump.radius_mm + half_lump_mm, inner_mm + 0.55 * wall_mm, inner_mm + 0.8 * wall_mm),
      body.outer_radius_mm};
  return make_annulus(grid);
}

ElasticModel model_around(const FieldModel& body, double C1_kPa, const Inclusion& lump) {
  ElasticOptions options;
  options.parameters = {C1_kPa};
  return {mesh_around(body, lump), *find_law("neo-hookean"), std::move(options)};
}

StiffnessField stiffness_of(const Inclusion& lump) {
  return [lump](const Eigen::Vector3d& X_mm) { return lump.stiffness({X_mm[0], X_mm[1], X_mm[2]}); };
}

const EffectParameter& parameter(size_t i) { return lump_effect().field_parameters()[i]; }

/// Whether a tangent of one lump still serves for the other.
bool alike(const LumpValues& a, const LumpValues& b) {
  for (size_t i = 0; i < lump_parameters; ++i) {
    const double apart = std::abs(to_coordinate(parameter(i), a[i]) - to_coordinate(parameter(i), b[i]));
    const double most = parameter(i).scale == SearchScale::logarithmic ? kept_ratio
                        : parameter(i).unit == "deg"                   ? kept_deg
                                                                       : kept_mm;
    if (apart > most) return false;
  }
  return true;
}

double largest(const NodeField& field) {
  double most = 0.0;
  for (const double value : field)
    most = std::isfinite(value) ? std::max(most, std::abs(value)) : HUGE_VAL;
  return most;
}

}  // namespace

const Effect& lump_effect() { return *find_effect("stiff-inclusion"); }

Inclusion lump_with(const LumpValues& values, const FieldModel& body) {
  FieldModel model = body;
  lump_effect().apply_to_field(values, model);
  return model.inclusion.value_or(Inclusion{.semi_axes_mm = {1.0, 1.0, 1.0}});
}

LumpBody::LumpBody(const FieldModel& body, double C1_kPa, double pressure_kPa, const Inclusion& lump)
    : body_(body), model_(model_around(body, C1_kPa, lump)) {
  Solution solution = model_.solve(pressure_kPa);
  if (!solution.report.converged()) return;
  state_ = solution.state;
  plain_ = std::move(solution.state);
}

std::optional<LumpBody::Addition> LumpBody::addition(const LumpValues& values) {
  if (!plain_) return {};
  wanted_ = values;
  model_.system().set_stiffness(stiffness_of(lump_with(values, body_)));
  if (!balance()) {
    state_ = *plain_;
    factored_.reset();
    return {};
  }
  Addition result{state_.position_mm, slopes(values)};
  for (size_t dof = 0; dof < result.position_mm.size(); ++dof)
    result.position_mm[dof] -= plain_->position_mm[dof];
  return result;
}

bool LumpBody::factorise() {
  factored_.reset();
  if (model_.system().factorise(state_).singular) return false;
  factored_ = wanted_;
  return true;
}

/// Equilibrium from the last one.
bool LumpBody::balance() {
  if (!factored_ || !alike(*factored_, wanted_)) {
    if (!factorise()) return false;
  }
  if (corrected_with_kept_factor()) return true;
  state_ = *plain_;
  return factorise() && corrected_with_kept_factor();
}

bool LumpBody::corrected_with_kept_factor() {
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

std::array<NodeField, lump_parameters> LumpBody::slopes(const LumpValues& values) {
  std::vector<StiffnessField> fields;
  for (size_t i = 0; i < lump_parameters; ++i) {
    const double h = parameter(i).scale == SearchScale::logarithmic ? 1e-3 : 1e-2;
    LumpValues up = values;
    LumpValues down = values;
    up[i] = from_coordinate(parameter(i), to_coordinate(parameter(i), values[i]) + h);
    down[i] = from_coordinate(parameter(i), to_coordinate(parameter(i), values[i]) - h);
    fields.push_back([above = stiffness_of(lump_with(up, body_)),
                      below = stiffness_of(lump_with(down, body_)),
                      h](const Eigen::Vector3d& X_mm) { return (above(X_mm) - below(X_mm)) / (2.0 * h); });
  }
  ElasticSystem& system = model_.system();
  std::vector<double> sides;
  for (const std::vector<double>& side : stiffness_sides(system, state_, fields))
    sides.insert(sides.end(), side.begin(), side.end());
  system.solve(sides, lump_parameters);
  std::array<NodeField, lump_parameters> result;
  for (size_t i = 0; i < lump_parameters; ++i)
    result[i] = system.node_field(std::span(sides).subspan(i * model_.dofs(), model_.dofs()));
  return result;
}

}  // namespace diastole::explain
