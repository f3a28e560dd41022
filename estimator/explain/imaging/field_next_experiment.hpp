#pragma once
// What to image next, and what to measure beside it.
//
// Two fits A and B of the same tags leave residuals r_A and r_B; their difference is what noise-free data of A would show B's
// model, B's unknowns at their best. A new acquisition weighs it otherwise, and B adapts again:
//
//   d^2 = |W delta|^2 - g' (K'K)^-1 g,    delta = r_B - r_A,  K = W J_B,  g = K' W delta,
//
// with rows for the tags, the frames' pressures, and C1, radius and cavity volumes where those are measured. Frames
// at higher pressure carry the loudest frame's rows on, by the power of the pressure with which delta grew so far.

#include <optional>
#include <vector>

#include "estimator/explain/imaging/field_hypotheses.hpp"
#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::explain {

/// A fit with what its cavity takes at the highest pressure; NaN where that is not known.
struct ImagedModel {
  const FieldHypothesis* hypothesis;
  double volume_change_mL;
};

/// For models that the images cannot distinguish: the least change of the acquisition by which the least distinguishable pair
/// parts by five sigmas, or else the best. Nothing for fewer than two.
std::optional<NextExperiment> separating_images(const FieldCase& field, const MotionResiduals& rows,
                                                const std::vector<ImagedModel>& competing);

/// For a named one: what narrows its least known parameter most. predicted_separation_sigma: that parameter's distance from
/// neutral afterwards.
NextExperiment sharpening_images(const FieldCase& field, const MotionResiduals& rows,
                                 const ImagedModel& named);

/// For an unexplained one: the same again, turned in the scanner, and unloaded afterwards.
NextExperiment exposing_images();

}  // namespace diastole::explain
