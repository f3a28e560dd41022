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

double memory_decay(double reynolds) {
  const double share = turbulence(reynolds);
  return share == 0.0 ? 0.0
                      : share * std::pow(reynolds, std::log10(15.29 / std::pow(reynolds, 0.0567))) / 12.86;
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
      brunone_(hose.brunone),
      to_place_(density_ * bore_m_ / (viscosity_ * table_step)) {
  make_table();
}

void WallFriction::make_table() {
  const double small = 1e-3 / to_place_;
  const auto inertia = [&](double reynolds) {
    return brunone_ * density_ * std::sqrt(shear_decay(reynolds)) / 4.0 * 1e-3;
  };
  const double spreading = 4.0 * viscosity_ / (density_ * bore_m_ * bore_m_);
  const auto growth = [&](double speed) {
    return (steady_kPa_per_m(speed + small) - steady_kPa_per_m(speed - small)) / 2e-3;
  };
  table_.reserve(table_size);
  double left = 0.0, left_growth = growth(0.0), left_inertia = inertia(0.0), left_forgetting = 0.0;
  for (size_t k = 1; k <= table_size; ++k) {
    const double speed = static_cast<double>(k) / to_place_;
    const double right = steady_kPa_per_m(speed), right_growth = growth(speed);
    const double right_inertia = inertia(table_step * static_cast<double>(k));
    const double right_forgetting = spreading * memory_decay(table_step * static_cast<double>(k));
    const double rise = right - left;
    table_.push_back({{left, left_growth, 3.0 * rise - 2.0 * left_growth - right_growth,
                       left_growth + right_growth - 2.0 * rise},
                      left_inertia,
                      right_inertia - left_inertia,
                      left_forgetting,
                      right_forgetting - left_forgetting});
    left = right, left_growth = right_growth, left_inertia = right_inertia;
    left_forgetting = right_forgetting;
  }
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

void WallFriction::Drag::resize(size_t places) {
  for (std::vector<double>* values : {&still_kPa_per_m, &by_rate, &forgetting})
    values->assign(places, 0.0);
}

void WallFriction::set_drag(const double* speed_m_s, const double* stretching, Drag& drag) const {
  constexpr auto last = static_cast<double>(table_size);
  for (size_t i = 0; i < drag.by_rate.size(); ++i) {
    const double speed = std::abs(speed_m_s[i]);
    const double place = std::min(speed * to_place_, last);  // not a number stays none
    const size_t k = place < last ? static_cast<size_t>(place) : table_size - 1;
    const Piece& piece = table_[k];
    const auto& [value, slope, square, cube] = piece.steady_kPa_per_m;
    const double s = place - static_cast<double>(k);
    const double steady =
        place < last ? value + s * (slope + s * (square + s * cube)) : steady_kPa_per_m(speed);
    const double by_rate = piece.inertia + s * piece.inertia_rise;
    const double turning = speed_m_s[i] / (speed + 1e-4);
    drag.by_rate[i] = by_rate;
    drag.forgetting[i] = piece.forgetting + s * piece.forgetting_rise;
    drag.still_kPa_per_m[i] =
        std::copysign(steady, speed_m_s[i]) + by_rate * wave_speed_m_s_ * turning * std::abs(stretching[i]);
  }
}

}  // namespace diastole::rig
