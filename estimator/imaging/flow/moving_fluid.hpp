#pragma once
// Where a phase-contrast cine shows moving fluid and where still material: by how a pixel's phase changes over the cycle, against its noise.

#include <Eigen/Dense>
#include <numbers>
#include <vector>

#include "estimator/imaging/flow/phase_contrast.hpp"

namespace diastole::imaging {

/// Standard deviations at a bright pixel from one phase of the cycle to another. Noise of the magnitude is white; that of the phase grows as
/// the magnitude falls, and magnitude times phase has the same noise everywhere.
struct PhaseNoise {
  double magnitude = 0;
  double magnitude_times_phase = 0;  ///< of magnitude x radians
};

struct MotionMap {
  PhaseNoise noise;
  Image mean_magnitude;
  Image mean_phase;  ///< weighted by the magnitude
  Image activity;  ///< mean square of magnitude x (phase - mean phase) over its noise; 1 where nothing moves
  size_t phases = 0;

  [[nodiscard]] bool has_signal(Eigen::Index pixel) const;
  /// The activity that still material exceeds once in 10^6 pixels, or in 10^3.
  [[nodiscard]] double moving_from() const;
  [[nodiscard]] double still_below() const;
};

inline constexpr double turn = 2 * std::numbers::pi;
/// Radians brought within half a turn of zero.
double within_half_turn(double radians);

MotionMap motion_map(const PhaseContrast& scan);

/// The share of the spectrum's lines that was measured, along rows and along columns: what a scanner fills up with zeros leaves its noise alike
/// between neighbours, at a distance of n pixels by sinc(n share). 1 where there is too little still material to measure it.
Eigen::Vector2d measured_share(const PhaseContrast& scan, const MotionMap& map,
                               const Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>& still);

/// Pixels that move and touch each other. Places in pixels: column, row.
struct MovingRegion {
  std::vector<Eigen::Vector2i> pixels;
  Eigen::Vector2d centre;
  double radius_px = 0;  ///< of a disc of that area
};

/// The one with the largest area first.
std::vector<MovingRegion> moving_regions(const MotionMap& map);

/// Pixels with signal, without motion, not at an edge and at least `clear_px` from what moves.
Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> still_pixels(const MotionMap& map,
                                                                const std::vector<MovingRegion>& regions,
                                                                int clear_px);

}  // namespace diastole::imaging
