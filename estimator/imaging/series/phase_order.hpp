#pragma once
// Whether the images of a slice follow each other as a motion's do: the farther apart in time, the farther apart in place, but where the motion
// turns, and there it is slow.
//
// Images are compared by the mean square of their difference. One that belongs elsewhere is as far off as a period of the tags
// makes: four times what a phase moves, noise included, and twice as far from both neighbours as they are from each other. Two that have each
// other's time make the motion turn back twice more than it does without, and make its way longer by a usual step: that is judged without the
// noise. It is not seen where the motion turns or rests, where it costs little.

#include <optional>
#include <vector>

#include "estimator/imaging/dicom/dicom_file.hpp"

namespace diastole::imaging {

struct PhaseOrder {
  struct LeftOut {
    size_t phase;
    std::optional<size_t>
        same_as;  ///< the neighbour that has the same pixels: which of the two they are, nobody knows
    double times_farther =
        0;  ///< from its neighbours, else, than they are from each other; the last one from all others than any two in succession
  };
  struct Exchange {
    size_t first, second;
    double saved;  ///< share of all differences from phase to phase
  };
  std::vector<size_t> kept;          ///< phases; the first one always
  std::vector<LeftOut> left_out;     ///< blank, shifted, another phase's
  std::optional<Exchange> exchange;  ///< two that are kept and seem to have each other's time
};

/// A cycle is imaged in some tens of phases. All pairs of them are compared.
inline constexpr size_t most_phases_compared = 100;

/// Precondition: images of one size, in order of time, not more than `most_phases_compared`. Of fewer than five, and of images that are all alike to
/// the bit, all are kept.
PhaseOrder order_of_phases(const std::vector<Image>& phases);

}  // namespace diastole::imaging
