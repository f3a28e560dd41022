#include "estimator/rig_fit/search_scale.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/rig_fit/rig_fit.hpp"

namespace diastole::rig {
namespace {

constexpr double small = 1e-3;  ///< of a typical size: far above rounding, far below curvature

}  // namespace

double to_search(SearchScale scale, double natural) {
  if (scale == SearchScale::logarithmic) return std::log(natural);
  if (scale == SearchScale::inverse_square) return 1e4 / (natural * natural);
  return natural;
}

double from_search(SearchScale scale, double sought) {
  if (scale == SearchScale::logarithmic) return std::exp(sought);
  if (scale == SearchScale::inverse_square) return 1e2 / std::sqrt(sought);
  return sought;
}

double natural_slope(SearchScale scale, double sought) {
  if (scale == SearchScale::logarithmic) return std::exp(sought);
  if (scale == SearchScale::inverse_square) return -0.5e2 / (sought * std::sqrt(sought));
  return 1.0;
}

std::vector<SearchCoordinate> search_coordinates(const std::vector<ModelTerm>& terms,
                                                 const std::vector<Unknown>& unknowns) {
  std::vector<SearchCoordinate> list{
      {SearchScale::linear, unknowns[0].lower, unknowns[0].upper, 1e-3 * unknowns[0].lower, false},
      {SearchScale::linear, unknowns[1].lower, unknowns[1].upper, 1.0, true},
      {SearchScale::linear, unknowns[2].lower, unknowns[2].upper, 1.0, true},
  };
  list[0].perturbation = std::max(list[0].perturbation, 1e-3);
  for (const ModelTerm& term : terms) {
    for (const EffectParameter& parameter : term.effect->parameters()) {
      const double a = to_search(parameter.scale, parameter.lower);
      const double b = to_search(parameter.scale, parameter.upper);
      double size = std::abs(to_search(parameter.scale, parameter.typical) -
                             to_search(parameter.scale, parameter.neutral));
      if (size == 0.0) size = 0.1 * std::abs(b - a);
      list.push_back({parameter.scale, std::min(a, b), std::max(a, b), small * size,
                      term.effect->stage() == Stage::sensors});
    }
  }
  return list;
}

}  // namespace diastole::rig
