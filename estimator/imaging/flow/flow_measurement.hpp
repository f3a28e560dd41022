#pragma once
// From one slice's phase contrast to flow and volume with errors: lumen found, background taken off, turns put back, scene fitted, cycle joined.

#include <optional>
#include <vector>

#include "estimator/imaging/flow/background_phase.hpp"
#include "estimator/imaging/flow/lumen_fit.hpp"
#include "estimator/imaging/flow/periodic_regression.hpp"
#include "estimator/imaging/flow/phase_contrast.hpp"
#include "estimator/io/finding.hpp"

namespace diastole::imaging {

struct FlowRequest {
  std::optional<Eigen::Vector2d> centre_px =
      {};  ///< column and row of a lumen, where the largest is not the one
  bool remove_background = true;
  bool close = false;  ///< correct the flow so that the cycle returns
};

struct ValueWithError {
  double value = 0, sigma = 0;
};

struct PhaseFlow {
  double phase_s = 0;
  ValueWithError flow_mL_s, volume_mL;  ///< volume above the cycle's least
  double core_cm_s = 0;                 ///< of the fastest fluid
  int turns = 0;                        ///< put back to it
};

struct FlowMeasurement {
  PhaseContrast scan;
  LumenFit lumen;
  BackgroundPhase background;
  std::vector<PhaseFlow> phases;
  PeriodicRegression flow;  ///< mL/s over the interval
  double least_s = 0;       ///< when the volume is least
  ValueWithError stroke_mL;
  ValueWithError closure_mL;  ///< what a cycle does not return, before any correction
  bool is_closed = false;
  size_t unwrapped = 0;  ///< phases to which turns were put back
  std::vector<Finding> findings;

  [[nodiscard]] double interval_s() const { return scan.interval_s; }
  [[nodiscard]] ValueWithError flow_at(double time_s) const;
  /// Above the least.
  [[nodiscard]] ValueWithError volume_at(double time_s) const;
};

/// Throws InputError with a remedy if no lumen is found or its turns cannot be determined.
FlowMeasurement measure_flow(PhaseContrast scan, const FlowRequest& request, const std::string& folder);

}  // namespace diastole::imaging
