#pragma once
// Table 1 of Augenstein et al. (J. Biomech. Eng. 127 (2005) 148): standard deviations of C, b1, b2, b3 of the paper's Eq. 5,
// in % of their mean, over ten refits of 3-D points with so much noise in so many frames.

#include <array>
#include <optional>

namespace diastole {

/// C, b1, b2, b3 for one of the table's noises (0.4, 0.8, 1.6, 3.2 mm) and numbers of frames (1, 3, 5).
std::optional<std::array<double, 4>> paper_sd_percent(double noise_mm, int frames);

}  // namespace diastole
