#pragma once
// By how much a lumen moves over the cycle, found before anything is fitted: a fit that starts all phases from one place does not find a tube that goes
// further than its edge is wide.

#include <Eigen/Dense>
#include <vector>

#include "estimator/imaging/flow/moving_fluid.hpp"

namespace diastole::imaging {

/// Of each phase, from the mean over the cycle, in pixels (column, row): the shift that makes its magnitude around `region` most like the other phases',
/// by least squares. Empty if the lumen stays within half a pixel, or if shifts do not make the phases more alike than chance does;
/// `noise` is the magnitude's.
std::vector<Eigen::Vector2d> lumen_movement_px(const std::vector<Image>& magnitude,
                                               const MovingRegion& region, double noise);

/// The images moved back by whole pixels, so that the lumen stays within half a pixel of its mean place.
std::vector<Image> held_still(const std::vector<Image>& images,
                              const std::vector<Eigen::Vector2d>& movement_px);

}  // namespace diastole::imaging
