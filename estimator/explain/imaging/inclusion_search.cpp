#include "estimator/explain/imaging/inclusion_search.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/explain/imaging/linear_evidence.hpp"
#include "estimator/explain/verdict/chi_square.hpp"

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

Eigen::MatrixXd responses(FieldProblem& problem, const FieldFit& base, const std::vector<Inclusion>& places) {
  std::vector<StiffnessField> fields;
  for (const Inclusion& place : places) {
    fields.push_back([place](const Eigen::Vector3d& X_mm) {
      return place.stiffness({X_mm[0], X_mm[1], X_mm[2]}) - 1.0;
    });
  }
  const size_t loudest = problem.highest_node();
  std::vector<double> shares = base.pressures_kPa;
  for (double& share : shares)
    share /= problem.nodes_kPa()[loudest];
  FieldSolver& solver = problem.solver();
  return problem.rows().columns(solver.mesh(),
                                solver.responses(loudest, solver.stiffness_sides(loudest, fields)), shares);
}

}  // namespace

double distinct_places(const FieldModel& body) {
  const double volume_mm3 =
      M_PI * body.height_mm *
      (body.outer_radius_mm * body.outer_radius_mm - body.inner_radius_mm * body.inner_radius_mm);
  return std::max(1.0, volume_mm3 / (8.0 * guessed_axis_mm * guessed_axis_mm * guessed_axis_mm));
}

InclusionLattice inclusion_lattice(FieldProblem& problem, const FieldFit& base) {
  std::vector<Inclusion> places = lattice(problem.field().base);
  Eigen::MatrixXd columns = responses(problem, base, places);
  return {std::move(places), std::move(columns)};
}

std::vector<InclusionGuess> search_inclusion(const InclusionLattice& lattice, const FieldModel& body,
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
    guess.p_value = std::min(1.0, distinct_places(body) * chi_square_tail(gain, 1.0));
  }
  if (best[1].gain > best[0].gain) std::swap(best[0], best[1]);
  return best;
}

}  // namespace diastole::explain
