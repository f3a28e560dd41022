#pragma once
// The host's clock against the controller's.
//
// The host asks for the time at host_sent_ns and has the answer at host_received_ns; the controller took the
// question at tick `received` and answered at `replied`. If both ways take equally long, the two mid-points
// are the same moment; they differ by at most half the round trip. Over a session the pairs lie on a line
//
//   controller_s = scale x (host_s - host_ref_s) + controller_ref_s,     drift_ppm = (scale - 1) x 1e6
//
// except for those that something delayed. Fit: start from the median of pairwise slopes (Theil 1950, Sen
// 1968, which up to 29 % of wild pairs cannot move), drop pairs further than 4.5 scaled median absolute
// deviations, and least squares of the rest, weighted by the inverse square of the round trip.

#include <cstddef>
#include <optional>
#include <span>

namespace diastole {

/// One moment read on two clocks.
struct ClockPair {
  double host_s = 0;
  double other_s = 0;
  double uncertainty_s = 1e-3;  ///< half the round trip
};

struct ClockMap {
  double host_ref_s = 0;
  double other_ref_s = 0;
  double scale = 1;
  double residual_s = 0;  ///< root mean square over the pairs used
  size_t pairs_dropped = 0;

  [[nodiscard]] double to_other_s(double host_s) const { return other_ref_s + scale * (host_s - host_ref_s); }
  [[nodiscard]] double to_host_s(double other_s) const {
    return host_ref_s + (other_s - other_ref_s) / scale;
  }
  [[nodiscard]] double drift_ppm() const { return (scale - 1) * 1e6; }
};

/// None without pairs. Pairs that span less than a second fix the offset only: scale stays 1.
std::optional<ClockMap> fit_clock_map(std::span<const ClockPair> pairs);

}  // namespace diastole
