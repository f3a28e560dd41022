#pragma once
// Ghosts: weaker copies of the picture, shifted along the phase encoding, that anything which differs from line group to line group
// leaves in a segmented acquisition. They lie over tissue as they lie over air, and there they are seen.

#include <cmath>
#include <numbers>
#include <vector>

#include "estimator/imaging/tracking/materials.hpp"

namespace diastole::imaging {

struct Ghost {
  bool down;           ///< shifted along a column, else along a row
  Eigen::Index shift;  ///< in pixels, cyclic, from 0 to before the extent
  double share;        ///< of the picture's brightness
  /// The part of `share` that is in phase with what it lies over, and its standard deviation. Unknown, half the power is.
  double in_phase = 0;
  double in_phase_sigma = share * std::numbers::sqrt2 / 2;

  /// What it lays over a pixel, but for its phase.
  [[nodiscard]] double over(const Image& image, Eigen::Index row, Eigen::Index column) const {
    Eigen::Index& from = down ? row : column;
    from -= shift;
    if (from < 0) from += down ? image.rows() : image.cols();
    return share * static_cast<double>(image(row, column));
  }
};

/// In air the mean square of an image is that of its noise and of what lies over it: it is regressed on the squares of the shifted
/// picture, all phases together, and a shift counts that explains it six standard errors better than none. `noise`: a phase's standard
/// deviation of a channel.
std::vector<Ghost> find_ghosts(const TagView& view, const std::vector<const MaterialMap*>& maps,
                               const std::vector<double>& noise);

}  // namespace diastole::imaging
