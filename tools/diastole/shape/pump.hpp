#pragma once
// What the pump can do: a drive as the controller would play it, held against its limits by the controller's own check
// (firmware/core/plan_check.hpp).

#include <optional>
#include <string>
#include <vector>

#include "estimator/shaping/drive_bounds.hpp"
#include "firmware/core/program.hpp"
#include "host/config/rig_config.hpp"

namespace diastole::shaping {

struct LimitUse {
  std::string limit;  ///< as protocol/wire/limit_list.inc names it, or "cavity"
  double asked = 0.0, allowed = 0.0;
  std::string unit;

  [[nodiscard]] double share() const { return asked / allowed; }
};

/// A waveform that the controller does not take at all (wire::Refusal::waveform_unfit).
inline constexpr const char* unfit_waveform = "waveform_unfit";

/// One cycle as an uploaded waveform.
struct PlannedCycle {
  std::vector<double> fraction;  ///< at even phases, 0 and 1 included
  double stroke_mL = 0.0;
  double offset_mL = 0.0;
  double period_s = 0.0;
  double lead_s = 0.0;            ///< from the cycle's beginning to that of the wanted curve
  double trigger_delay_ms = 0.0;  ///< with which the trigger comes there, or as near as it may
  double trigger_late_ms = 0.0;   ///< by which it comes later all the same
  std::vector<LimitUse> limits;
  std::string refusal;  ///< the first limit that it exceeds, or unfit_waveform; empty: none
};

class Pump {
 public:
  explicit Pump(const RigConfig& rig);

  /// What the specimen may hold against the piston: the pressure limit's check counts with it.
  [[nodiscard]] double cavity_limit_kPa() const { return 1e-3 * settings_.limits().cavity_Pa; }
  /// RMS by which the piston's whole microsteps are beside a curve.
  [[nodiscard]] double rounding_mL() const;

  /// With that number of points with which the controller's curve turns most softly.
  [[nodiscard]] PlannedCycle planned(const PeriodicCurve& drive_mL) const;
  /// The drive whose volume is nearest, by its derivatives, among those that the controller accepts.
  [[nodiscard]] PeriodicCurve nearest(const PeriodicCurve& drive_mL, const Eigen::MatrixXd& slope) const;

 private:
  [[nodiscard]] DriveBounds bounds(double share) const;

  firmware::Settings settings_;
  double ttl_width_ms_;
};

}  // namespace diastole::shaping
