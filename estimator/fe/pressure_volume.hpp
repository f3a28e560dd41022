#pragma once
// The pressure-volume curve of the closed cavity: its volume is led from rest to a value in equal steps, its pressure
// is the unknown (Lagrange multiplier on the volume), so that the curve is followed over pressure maxima, where no
// pressure control can.
//
// With B the tangent that has the cavity's row and K the one at given pressure, negative pivots obey
// n(B) = n(K) + [dP/dV > 0]: a state is stable at held volume if n(B) equals the unknown pressures, and at held
// pressure if dP/dV > 0 besides.

#include <functional>
#include <vector>

#include "estimator/fe/elastic_model.hpp"

namespace diastole {

struct PressureVolumePoint {
  double volume_change_mL = 0.0;
  double pressure_kPa = 0.0;
  double stiffness_kPa_per_mL = 0.0;  ///< dP/dV, exact
  double stored_energy_mJ = 0.0;
  bool stable_at_volume = true;
  size_t newton_iterations = 0;  ///< from the point before
};

/// A pressure maximum or minimum between two points.
struct LimitPoint {
  double volume_change_mL = 0.0;
  double pressure_kPa = 0.0;
};

struct PressureVolumeCurve {
  std::vector<PressureVolumePoint> points;  ///< from rest
  std::vector<LimitPoint> limits;           ///< where the cubic through two points and their slopes is level
  SolveReport last;                         ///< how the last step ended
  ElasticState state;                       ///< at the last point

  /// Work of the pressure from rest, mJ: the same cubics integrated. The stored energy's equal at the last point.
  [[nodiscard]] double work_mJ() const;
};

struct PressureVolumeOptions {
  double volume_change_mL = 0.0;  ///< at the end; negative empties the cavity
  size_t steps = 20;
  bool judge_stability = true;  ///< one more factorisation a point; without it stable_at_volume stays true
  Load load{};                  ///< fibre tension at all points; the pressure is of no account
  /// Called after each point; false ends the curve there.
  std::function<bool(const PressureVolumePoint&)> on_point{};
};

/// Precondition: the cavity is closed, steps > 0.
PressureVolumeCurve pressure_volume_curve(ElasticModel& model, const PressureVolumeOptions& options);

}  // namespace diastole
