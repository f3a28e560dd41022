#pragma once
// Angles are in degrees (`_deg`) where people read or write them, and in radians where they are computed with:
// angle_deg * rad_per_deg, angle_rad / rad_per_deg.

#include <numbers>

namespace diastole {

inline constexpr double rad_per_deg = std::numbers::pi / 180.0;

}  // namespace diastole
