#pragma once
// The cavity at the hose's far end: specimen, leaks to outside, gas beside it.

#include <memory>
#include <vector>

#include "estimator/rig/gas_pocket.hpp"
#include "estimator/rig/rig_model.hpp"

namespace diastole::rig {

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
