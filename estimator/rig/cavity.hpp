#pragma once
// The cavity at the hose's far end: specimen, leaks to outside, gas beside it.

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "estimator/rig/rig_model.hpp"

namespace diastole::rig {

/// A pocket of gas at atmospheric pressure when at rest: (p_a + p) V^n = p_a V0^n.
class GasPocket {
 public:
  GasPocket(double volume_mL, double exponent, double atmosphere_kPa)
      : volume_mL_(volume_mL), exponent_(exponent), atmosphere_kPa_(atmosphere_kPa) {}

  /// Less than 0.05 mL is left out: stiffer than the hose, it would ask for far shorter steps than anybody can see.
  [[nodiscard]] bool present() const { return volume_mL_ >= 0.05; }
  /// Pressure above atmosphere when the gas is squeezed by this volume.
  [[nodiscard]] double pressure_kPa(double squeezed_mL) const {
    const double left = std::max(1.0 - squeezed_mL / volume_mL_, 0.05);
    return atmosphere_kPa_ * (std::pow(left, -exponent_) - 1.0);
  }
  [[nodiscard]] double squeezed_mL(double pressure_kPa) const {
    const double ratio = std::max(1.0 + pressure_kPa / atmosphere_kPa_, 0.05);
    return volume_mL_ * (1.0 - std::pow(ratio, -1.0 / exponent_));
  }
  [[nodiscard]] double stiffness_at_rest() const { return exponent_ * atmosphere_kPa_ / volume_mL_; }

 private:
  double volume_mL_, exponent_, atmosphere_kPa_;
};

class Cavity {
 public:
  Cavity(const RigModel& model, const RunPlace& place);

  /// The pressure when this volume has come out of the hose by now; what was lost before is taken off.
  double look(double arrived_mL, double time_s);
  /// Goes on to the time just looked at: memories and leaks follow the pressure that was found.
  void pass();
  [[nodiscard]] double specimen_mL() const { return specimen_mL_; }

 private:
  /// Pressure of the specimen; sets elastic_kPa_.
  double pressure_kPa(double specimen_mL, double time_s);

  const RigModel& model_;
  GasPocket gas_;
  std::vector<std::unique_ptr<SpecimenMemory>> memories_;
  std::vector<LeakLaw> leaks_;
  // As just looked at.
  double specimen_mL_ = 0.0;
  double elastic_kPa_ = 0.0;
  double pressure_kPa_ = 0.0;
  double time_s_ = 0.0;

  double lost_mL_ = 0.0;
  double leak_mL_per_s_ = 0.0;
  double passed_s_ = 0.0;
  bool begun_ = false;
};

}  // namespace diastole::rig
