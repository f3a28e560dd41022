#include "estimator/imaging/series/image_series.hpp"

namespace diastole::imaging {

std::string describe(SeriesKind kind) {
  switch (kind) {
    case SeriesKind::tagged_cine:
      return "tagged cine";
    case SeriesKind::cine:
      return "cine";
    case SeriesKind::velocity:
      return "velocity";
    case SeriesKind::diffusion:
      return "diffusion";
    case SeriesKind::anatomy:
      break;
  }
  return "anatomy";
}

const SliceImages& ImageSeries::clearest() const {
  const auto prominence = [](const SliceImages& slice) {
    return slice.tags.empty() ? 0.0 : slice.tags[0].prominence;
  };
  const SliceImages* best = &slices[slices.size() / 2];
  for (const SliceImages& slice : slices) {
    if (prominence(slice) > prominence(*best)) best = &slice;
  }
  return *best;
}

}  // namespace diastole::imaging
