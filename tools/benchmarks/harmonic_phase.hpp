#pragma once
// The yardstick of tag tracking: harmonic phase (Osman, Kerwin, McVeigh and Prince, Magn. Reson. Med. 42 (1999) 1048).
//
// A band-pass about the tags' frequency k leaves  H(x) ~ - exp(i phi(x)),  whose phase rides with the material: a tag's dark line is where
// phi is a multiple of 2 pi. The filter is a Gaussian that has fallen to e^-2 at half of k, as wide as it may be without the spectrum's
// centre; evaluated by its definition, between pixels too.

#include <optional>

#include "estimator/imaging/tracking/tag_view.hpp"

namespace diastole {

/// How far along the tags' normal from `x_mm` (in the slice) the nearest line of phase 0 lies; nothing where the search
/// leaves a tag spacing.
std::optional<double> harmonic_line_mm(const imaging::Image& image, const imaging::SlicePlane& plane,
                                       const imaging::TagWave& wave, const Eigen::Vector2d& x_mm);

}  // namespace diastole
