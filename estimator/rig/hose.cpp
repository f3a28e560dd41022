#include "estimator/rig/hose.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace diastole::rig {
namespace {

constexpr double laminar_below = 2000.0;
constexpr double turbulent_above = 4000.0;
constexpr double table_step = 100.0;
constexpr size_t table_size = 1000;

/// From 0 below the laminar limit to 1 above the turbulent one, with level ends: the transition has no kinks that would
/// drive the line's resonances.
double turbulence(double reynolds) {
  const double part = std::clamp((reynolds - laminar_below) / (turbulent_above - laminar_below), 0.0, 1.0);
  return part * part * (3.0 - 2.0 * part);
}

double shear_decay(double reynolds) {
  constexpr double laminar = 0.00476;
  const double share = turbulence(reynolds);
  if (share == 0.0) return laminar;
  const double turbulent = 7.41 / std::pow(reynolds, std::log10(14.3 / std::pow(reynolds, 0.05)));
  return share * turbulent + (1.0 - share) * laminar;
}

}  // namespace

double Hose::area_mm2() const { return std::numbers::pi / 4.0 * bore_mm * bore_mm; }

double Hose::inertance() const {
  return inertance_factor * density_kg_m3 * length_m / (area_mm2() * 1e-6) * 1e-9;
}

double Hose::compliance_mL_per_kPa() const {
  return area_mm2() * 1e-6 * length_m / (density_kg_m3 * wave_speed_m_s * wave_speed_m_s) * 1e9;
}

WallFriction::WallFriction(const Hose& hose)
    : density_(hose.density_kg_m3),
      viscosity_(hose.viscosity_Pa_s),
      bore_m_(hose.bore_mm * 1e-3),
      wave_speed_m_s_(hose.wave_speed_m_s),
      unsteady_(hose.unsteady_friction) {
  for (size_t k = 0; k < table_size; ++k)
    brunone_table_.push_back(std::sqrt(shear_decay(table_step * static_cast<double>(k))) / 4.0);
}

double WallFriction::reynolds(double speed_m_s) const {
  return density_ * std::abs(speed_m_s) * bore_m_ / viscosity_;
}

double WallFriction::steady_kPa_per_m(double speed_m_s) const {
  const double re = reynolds(speed_m_s);
  const double laminar = 32.0 * viscosity_ / (bore_m_ * bore_m_) * speed_m_s;
  if (re <= laminar_below) return laminar * 1e-3;
  const double blasius = 0.3164 / std::sqrt(std::sqrt(re));
  const double turbulent = blasius * density_ * speed_m_s * std::abs(speed_m_s) / (2.0 * bore_m_);
  const double share = turbulence(re);
  return (share * turbulent + (1.0 - share) * laminar) * 1e-3;
}

double WallFriction::brunone(double reynolds) const {
  const double place = reynolds / table_step;
  const size_t k = static_cast<size_t>(std::min(place, static_cast<double>(table_size - 2)));
  const double part = std::min(place - static_cast<double>(k), 1.0);
  return (1.0 - part) * brunone_table_[k] + part * brunone_table_[k + 1];
}

double WallFriction::unsteady_kPa_per_m(double speed_m_s, double speed_rate, double stretching) const {
  if (!unsteady_) return 0.0;
  const double turning = speed_m_s / (std::abs(speed_m_s) + 1e-4);
  return density_ * brunone(reynolds(speed_m_s)) *
         (speed_rate + wave_speed_m_s_ * turning * std::abs(stretching)) * 1e-3;
}

}  // namespace diastole::rig
