#pragma once
// Where a fit misses, and how well fits predict tags that they have not seen.
//
// The tags are dealt into five folds by the direction in which they know the motion (3-D points by turns). Each fold is
// predicted by the fit to the others: one Gauss-Newton step away from the fit to all. Of the predictions' errors those
// parts count in which the motion can be off at all: their projection on smooth modes, beside what is measured besides the
// tags: the frames' pressures, and C1 where it is known. Their reduced chi2 is 1 for noise.

#include <Eigen/Dense>
#include <vector>

#include "estimator/explain/imaging/field_fit.hpp"
#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::explain {

/// Fold of each row.
std::vector<size_t> deal_folds(const Measurement& measurement, const MotionResiduals& rows, size_t folds);

/// `directions` over the rows: a basis of what may be off.
Gap field_gap(const FieldFit& base, const FieldFit& after, const std::vector<size_t>& folds,
              const Eigen::MatrixXd& directions);

// Where on the specimen a fit's residuals keep a direction: cells in each of which the displacement may be off by a vector
// (outwards, around, along z) that grows with the load. The finest cells are 45 degrees, a quarter of the height and half
// the wall; where rings, layers or quarters of the specimen stand out more than any of those, they are the place.

/// The cells that are beyond chance after correction for their number, strongest first, at most `most`.
std::vector<Misfit> misfit_regions(const HermiteMesh& mesh, const MotionResiduals& rows, const FieldFit& fit,
                                   size_t most);

}  // namespace diastole::explain
