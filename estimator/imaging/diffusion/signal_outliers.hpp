#pragma once
// Images that lost signal, or gained some: motion during a readout, a spike, a scaling that changed. Every image of a slice is predicted from the
// tensors of the slice's other images; the median over voxels of its log signal minus the prediction is the log of its gain. Images of one b value
// are held against their middle, which kurtosis and the floor of noise move away from what a tensor predicts: that is a finding of its own.

#include <vector>

#include "estimator/imaging/diffusion/diffusion_series.hpp"

namespace diastole::imaging {

struct SignalOutlier {
  size_t volume = 0;
  size_t slice = 0;
  double gain = 1;  ///< its signal over that predicted
};

/// Takes the outliers out of the series, the worst of a slice first, and reports each volume in `findings`. What cannot be predicted - the only b = 0
/// image of a slice, six directions of one b value - is not judged. Throws InputError if more than a third of a slice's images would go.
std::vector<SignalOutlier> remove_outliers(DiffusionSeries& series, const std::string& folder);

}  // namespace diastole::imaging
