#pragma once
// The fluid-filled catheter with its transducer, exactly integrated for pressure that is linear between samples.

#include <span>
#include <vector>

#include "estimator/rig/rig_model.hpp"

namespace diastole::rig {

/// From rest at the first pressure.
std::vector<double> through_catheter(const Catheter& catheter, std::span<const double> pressure_kPa,
                                     double step_s);

}  // namespace diastole::rig
