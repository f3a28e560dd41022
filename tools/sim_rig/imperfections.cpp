#include "tools/sim_rig/imperfections.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace diastole::sim_rig {

void draw_imperfections(uint64_t seed, PlantConfig& plant) {
  if (seed == 0) return;
  std::mt19937_64 random(seed);
  // The library's distributions differ between implementations; a rig is the same everywhere.
  const auto even = [&] { return (static_cast<double>(random() >> 11) + 0.5) * 0x1p-53; };
  const auto off_by = [&](double sd) {
    constexpr double widest_sds = 2.5;  // what is further off, somebody has sent back
    const double normal = std::sqrt(-2 * std::log(even())) * std::cos(2 * std::numbers::pi * even());
    return sd * std::clamp(normal, -widest_sds, widest_sds);
  };
  const auto between = [&](double low, double high) { return low + (high - low) * even(); };

  HoseConfig& hose = plant.hose;
  hose.length_m *= 1 + off_by(0.005);       // cut and stretched
  hose.bore_mm *= 1 + off_by(0.005);        // extrusion tolerance of tubing
  hose.wave_speed_m_s *= 1 + off_by(0.06);  // the wall's modulus from a data sheet
  hose.wall_creep_fraction *= 1 + off_by(0.3);
  hose.segments = segments_for(hose);
  plant.minor_loss_K *= 1 + off_by(0.15);                       // fittings, from a handbook
  plant.piston_lag_ms *= between(0.5, 1.2);                     // motor and filter
  plant.flaws.drive.gain = off_by(0.002);                       // bore and lead of the pump
  plant.flaws.pump.compliance_mL_per_kPa = between(0, 0.0015);  // screw, coupling and seal yield

  for (SensorConfig* sensor : {&plant.cavity, &plant.pump}) {
    sensor->f0_Hz *= 1 + off_by(0.1);  // catheter and dome: a pop test's scatter
    sensor->zeta *= 1 + off_by(0.1);
  }
  plant.flaws.sensors.gain = off_by(0.004);  // calibration against a column

  SpecimenFlaws& gel = plant.flaws.specimen;
  gel.inner_radius_part = off_by(0.003);    // casting mould and swelling
  gel.stiffening = std::abs(off_by(0.05));  // polymer chains are finite
  gel.relaxing = {between(0.003, 0.01), between(0.003, 0.01), between(0, 0.005)};
}

}  // namespace diastole::sim_rig
