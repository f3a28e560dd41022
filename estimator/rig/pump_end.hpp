#pragma once
// What gives way between piston and hose: the drive (screw, piston, cylinder) and a pocket of gas, two springs in series, and leaks
// past the seal beside them.
//
//   The drive: p C = e_d + tau e_d', tau its friction. The gas: (p_a + p) V^n = p_a V0^n, e_g = V0 - V.
//   Both together take what the piston has displaced, the hose has not, and no leak q(p) has lost:  e_d + e_g = -y - int q dt.
//   e_d' is taken as the drive's share C / (C + C_g) of the rate, C_g = V0 / (n p_a): exact for gas that is squeezed little. The
//   smallest pockets are damped as the drive is.
//
// The hose's line holds the linear part of it (p = -K y - R y'); what differs is a load. Leaks are met by the trapezoid rule. Where
// they are not in proportion to the pressure, the load at a step's end is that of the state to which it brings the line: it may
// stand for nearly all of what the linear part makes, and be a hundred times as steep as what is left.

#include <optional>
#include <vector>

#include "estimator/rig/gas_pocket.hpp"
#include "estimator/rig/hose_line.hpp"
#include "estimator/rig/rig_model.hpp"

namespace diastole::rig {

/// One lives for one run.
class PumpEnd {
 public:
  PumpEnd(const RigModel& model, const RunPlace& place, double step_s);

  /// K, kPa/mL; none if neither drive nor gas gives way.
  [[nodiscard]] std::optional<double> stiffness() const;
  /// R, kPa s/mL; none if the piston's volume enters the hose whole.
  [[nodiscard]] std::optional<double> resistance() const;
  /// The pressure, less what the linear end makes, when y mL have entered beyond what the piston displaced, at this rate.
  [[nodiscard]] double load_kPa(double yielded_mL, double yielding_mL_per_s, double time_s) const;
  /// Whether something leaks that is not in proportion to the pressure.
  [[nodiscard]] bool leaks() const { return !leaks_.empty(); }
  /// Only then. With `load_kPa` at a step's end y and y' have come to this; with so much more, which moves them on by `by_load`, the
  /// load is that of where they come to.
  [[nodiscard]] double missing_load_kPa(double yielded_mL, double yielding_mL_per_s, double load_kPa,
                                        const YieldByLoad& by_load, double time_s) const;
  /// Goes on by a step that began with this pressure in the cylinder: what leaks follows it.
  void pass(double cylinder_kPa, double time_s);

 private:
  /// What leaks beyond the conductance, mL/s.
  [[nodiscard]] double leaks_beyond(double pressure_kPa, double time_s) const;
  /// What drive, gas and leaks have taken with their friction; of a rigid end by the second.
  [[nodiscard]] double absorbed_mL(double yielded_mL, double yielding_mL_per_s) const;
  /// The pressure at which they, and what gives way beside them, have taken this volume; of several the one that is found from `near_kPa`.
  [[nodiscard]] double pressure_kPa(double absorbed_mL, double beside_mL_per_kPa, double near_kPa,
                                    double time_s) const;

  double step_s_;
  double compliance_mL_per_kPa_;  ///< of the drive
  GasPocket gas_;
  double conductance_mL_s_kPa_;
  std::vector<LeakLaw> leaks_;
  bool springs_ = false;    ///< drive or gas gives way
  double damping_s_ = 0.0;  ///< of both springs' rate
  double leaking_s_ = 1.0;  ///< for how long a leak has acted at a step's end; 1: rates stand for volumes
  double linear_ = 0.0;     ///< taken by a kPa, at rest
  double leaked_mL_ = 0.0;  ///< in the steps before, but for the last one's half
};

}  // namespace diastole::rig
