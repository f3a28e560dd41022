#pragma once
// What a rig may have that its description does not hold. Neutral values leave the plant exactly as it is.

#include <array>
#include <functional>

namespace diastole::sim_rig {

/// Between the controller's steps and the piston, volumes as they arrive.
struct DriveFlaws {
  double gain = 0;          ///< the piston displaces 1 + gain of the nominal volume
  double backlash_mL = 0;   ///< play of screw and nut: that much is lost at each turn
  int missed_in_cycle = 0;  ///< from 1; while inflating there the motor stalls until
  double missed_mL = 0;     ///< that much is lost for good
  double stick_mL =
      0;  ///< the seal sticks at some turns: the piston waits until the screw has wound up so far, and jumps
  double stick_share = 0;  ///< of the turns
};

/// At the pump's outlet: gas p (V)^1.2 = const, what yields in proportion to the pressure (screw, seal), and a leak to
/// outside.
struct PumpFlaws {
  double gas_mL = 0;
  double compliance_mL_per_kPa = 0;
  double leak_mL_s_kPa = 0;
};

struct CavityFlaws {
  double gas_mL = 0;
  double leak_mL_s_kPa = 0;
  double kink_K = 0;  ///< the hose kinks at the cannula while the cavity holds more than
  double kink_above_mL = 0;
};

/// Of the gel, as it stands and as it remembers.
struct SpecimenFlaws {
  double inner_radius_part = 0;      ///< larger by this part of 22.5 mm
  double stiffening = 0;             ///< beta of W = C1/beta (exp(beta (I1 - 3)) - 1)
  double bond_left = 1;              ///< of what the bonded ends add to the long cylinder's stiffness
  double chamber_kPa_mL = 0;         ///< a closed chamber around it adds k V
  std::array<double, 3> relaxing{};  ///< parts of the pressure that relax in
  std::array<double, 3> relaxing_s{0.1, 1.0, 6.0};  ///< these times
  double softening = 0;  ///< delta: p (1 - delta (1 - exp(-n / cycles)) (1 - exp(-V_max / V0)))
  double softening_cycles = 2;
  double softening_V0_mL = 12;
  double warming = 0;  ///< C1 grows by this part, in
  double warming_s = 200;
};

/// Of a transducer and what reads it.
struct SensorFlaws {
  double gain = 0;
  double step_kPa = 0;  ///< the zero jumps at the start of
  int step_in_cycle = 0;
  double drift_kPa_s = 0;  ///< since the first cycle
  double delay_s = 0;      ///< readings show what was there this much earlier
  double lag_ppm = 0;      ///< and later and later since the first cycle
  double hum_kPa = 0;      ///< pickup, swelling and fading once in 7 s
  double hum_Hz = 0;
};

/// Laws of somebody's own, from a file (tools/sim_rig/hidden_file.hpp); empty: none. Times since the first cycle.
struct OwnLaws {
  std::function<double(double volume_mL, double time_s)> piston_mL =
      {};  ///< displaced if the steps command so much
  std::function<double(double pressure_kPa, double time_s)> pump_leak_mL_s = {};
  std::function<double(double pressure_kPa, double time_s)> cavity_leak_mL_s = {};
  std::function<double(double pressure_kPa, double volume_mL, double time_s)> specimen_kPa = {};
  std::function<double(double pressure_kPa, double time_s)> seen_kPa = {};  ///< by the cavity's sensor
};

struct Flaws {
  OwnLaws own{};
  DriveFlaws drive{};
  PumpFlaws pump{};
  CavityFlaws cavity{};
  SpecimenFlaws specimen{};
  SensorFlaws sensors{};  ///< gain, step and drift at the cavity only; the rest at both
};

}  // namespace diastole::sim_rig
