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

}  // namespace diastole::imaging
