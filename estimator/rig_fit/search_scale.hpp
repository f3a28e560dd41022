#pragma once
// The coordinates in which unknowns are searched.

#include <vector>

#include "estimator/effects/effect.hpp"

namespace diastole::rig {

struct ModelTerm;
struct Unknown;

double to_search(SearchScale scale, double natural);
double from_search(SearchScale scale, double sought);
/// d natural / d sought.
double natural_slope(SearchScale scale, double sought);

struct SearchCoordinate {
  SearchScale scale = SearchScale::linear;
  double lower = 0.0;
  double upper = 0.0;
  double perturbation = 0.0;  ///< for differences
  bool sensors_only = false;
};

/// One an unknown: the modulus, two offsets, the terms' parameters.
std::vector<SearchCoordinate> search_coordinates(const std::vector<ModelTerm>& terms,
                                                 const std::vector<Unknown>& unknowns);

}  // namespace diastole::rig
