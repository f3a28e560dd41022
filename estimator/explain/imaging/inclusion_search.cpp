#include "estimator/explain/imaging/inclusion_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "estimator/explain/imaging/linear_evidence.hpp"
#include "estimator/inference/tail_probability.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole::explain {
namespace {

constexpr double guessed_axis_mm = 10.0;

std::vector<Inclusion> lattice(const FieldModel& body) {
  constexpr int turns = 16;
  constexpr int levels = 9;
  std::vector<Inclusion> places;
  const double wall_mm = body.outer_radius_mm - body.inner_radius_mm;
  for (const double depth : {0.2, 0.5, 0.8}) {
    for (int level = 0; level < levels; ++level) {
      for (int turn = 0; turn < turns; ++turn) {
        const double height = -0.8 + 1.6 * level / (levels - 1);
        places.push_back({.contrast = 2.0,
                          .radius_mm = body.inner_radius_mm + depth * wall_mm,
                          .z_mm = 0.5 * height * body.height_mm,
                          .theta_deg = 360.0 * turn / turns,
                          .semi_axes_mm = {guessed_axis_mm, guessed_axis_mm, guessed_axis_mm},
                          .edge_width_mm = 4.0});
      }
    }
  }
  return places;
}

/// About one in each room of the guessed size.
std::vector<Inclusion> places_in(const HermiteMesh& mesh) {
  constexpr double apart_mm = 0.7 * guessed_axis_mm;
  constexpr std::array<double, 3> within{1.0 / 6.0, 0.5, 5.0 / 6.0};
  std::vector<Inclusion> places;
  std::vector<Eigen::Vector3d> centres_mm;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (size_t i = 0; i < 27; ++i) {
      const MaterialPoint point{e, {within[i % 3], within[i / 3 % 3], within[i / 9]}};
      const Eigen::Vector3d X_mm = mesh.value(mesh.reference(), point);
      if (std::ranges::any_of(centres_mm,
                              [&](const auto& other) { return (other - X_mm).norm() < apart_mm; }))
        continue;
      centres_mm.push_back(X_mm);
      places.push_back({.contrast = 2.0,
                        .radius_mm = std::hypot(X_mm[0], X_mm[1]),
                        .z_mm = X_mm[2],
                        .theta_deg = std::atan2(X_mm[1], X_mm[0]) / rad_per_deg,
                        .semi_axes_mm = {guessed_axis_mm, guessed_axis_mm, guessed_axis_mm},
                        .edge_width_mm = 4.0});
    }
  }
  return places;
}

}  // namespace

double distinct_places(double volume_mm3) {
  return std::max(1.0, volume_mm3 / (8.0 * guessed_axis_mm * guessed_axis_mm * guessed_axis_mm));
}

double wall_volume_mm3(const FieldModel& body) {
  return std::numbers::pi * body.height_mm *
         (body.outer_radius_mm * body.outer_radius_mm - body.inner_radius_mm * body.inner_radius_mm);
}

InclusionLattice inclusion_lattice(std::vector<Inclusion> places, const MotionResiduals& rows,
                                   ElasticModel& body, const ElasticState& state,
                                   const std::vector<double>& shares) {
  const HermiteMesh& mesh = body.mesh();
  std::vector<GaussNumbers> fields;
  for (const Inclusion& place : places) {
    fields.push_back(at_gauss_points(mesh, [&](const MaterialPoint& point) {
      const Eigen::Vector3d X_mm = mesh.value(mesh.reference(), point);
      return place.stiffness({X_mm[0], X_mm[1], X_mm[2]}) - 1.0;
    }));
  }
  Eigen::MatrixXd columns =
      rows.columns(mesh, responses(body, state, stiffness_sides(body.system(), state, fields)), shares);
  return {std::move(places), std::move(columns)};
}

InclusionLattice inclusion_lattice(FieldProblem& problem, const FieldFit& base) {
  const size_t loudest = problem.highest_node();
  std::vector<double> shares = base.pressures_kPa;
  for (double& share : shares)
    share /= problem.nodes_kPa()[loudest];
  FieldSolver& solver = problem.solver();
  return inclusion_lattice(lattice(problem.field().base), problem.rows(), solver.elastic(),
                           solver.state(loudest), shares);
}

InclusionLattice inclusion_lattice(const MotionResiduals& rows, ElasticModel& body, const ElasticState& state,
                                   const std::vector<double>& shares) {
  return inclusion_lattice(places_in(body.mesh()), rows, body, state, shares);
}

std::vector<InclusionGuess> search_inclusion(const InclusionLattice& lattice, double volume_mm3,
                                             const FieldFit& fit) {
  const std::vector<Inclusion>& places = lattice.places;
  const LinearEvidence evidence(fit, lattice.columns);
  std::vector<InclusionGuess> best(2);
  for (size_t i = 0; i < places.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const double gain = evidence.gain(column);
    const double amount = evidence.amount(column);
    InclusionGuess& guess = best[amount > 0.0 ? 0 : 1];
    if (gain <= guess.gain) continue;
    guess.gain = gain;
    guess.inclusion = places[i];
    guess.inclusion.edge_width_mm = 2.0;
    // An inclusion saturates: its own strain vanishes as it stiffens.
    guess.inclusion.contrast = amount > 0.0 ? std::min(4.0, 1.0 + 1.5 * amount) : std::max(0.3, 1.0 + amount);
    guess.p_value = std::min(1.0, distinct_places(volume_mm3) * inference::chi_square_tail(gain, 1.0));
  }
  if (best[1].gain > best[0].gain) std::swap(best[0], best[1]);
  return best;
}

}  // namespace diastole::explain
