#pragma once
// Where on the specimen a fit's residuals keep a direction: cells in each of which the displacement may be off by a vector
// (outwards, around, along z) that grows with the load. The finest cells are 45 degrees, a quarter of the height and half
// the wall; where rings, layers or quarters of the specimen stand out more than any of those, they are the place.

#include <vector>

#include "estimator/explain/imaging/field_fit.hpp"
#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::explain {

/// The cells that are beyond chance after correction for their number, strongest first, at most `most`.
std::vector<Misfit> misfit_regions(const FieldCase& field, const MotionResiduals& rows, const FieldFit& fit,
                                   size_t most);

}  // namespace diastole::explain
