#pragma once
// Tags of one slice followed through the cycle.
//
// Image k is  sum_j amplitude_j(x) pattern_j(phi(x))  in tissue (tag_model.hpp), with  phi = 2 pi (k . x - offset + w / spacing)  and the
// motion w of motion_field.hpp. Amplitudes are smooth fields (brightness.hpp), w a spline surface; both by least squares over
// the pixels that are surely tissue:
//   1. materials (materials.hpp) and the tags' planes at rest (rest_waves.hpp);
//   2. phase by phase from the motion of the phases before (image_fit.hpp), with the tissue's edge found anew each time;
//   3. how alike neighbours and phases are is learnt from the result (motion_prior.hpp), and all phases are fitted at once.
// The covariance of step 3 carries the noise as it is near the tags' own frequency (tag_noise.hpp) and what the fit
// leaves unexplained.

#include <optional>
#include <string>
#include <vector>

#include "estimator/imaging/tracking/ghost.hpp"
#include "estimator/imaging/tracking/motion_field.hpp"
#include "estimator/imaging/tracking/residual_excess.hpp"
#include "estimator/imaging/tracking/tag_view.hpp"
#include "estimator/imaging/tracking/tracked_phase.hpp"

namespace diastole::imaging {

struct TrackedView {
  std::vector<TagWave> waves;       ///< as refined: the tags at rest
  std::vector<MotionField> motion;  ///< one a direction
  std::vector<TrackedPhase> phases;
  ResidualExcess excess;             ///< of the residuals, over their noise
  std::vector<double> noise_factor;  ///< a direction: noise power near the tags' frequency over the mean
  double kappa_per_mm = 0;
  std::vector<Ghost> ghosts;
};

struct TrackingFault {
  std::string reason;  ///< "no tissue was found"
};

/// Deterministic. `fault` is set, and the result empty, where nothing can be tracked.
TrackedView track_view(const TagView& view, std::optional<TrackingFault>& fault);

}  // namespace diastole::imaging
