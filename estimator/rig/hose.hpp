#pragma once
// The hose between pump and specimen: what it is made of, and the friction of the fluid in it.
//
// Units: m, mm where named so, kPa, mL, s; a pressure gradient is kPa/m. Thread-safe: values only.

#include <vector>

namespace diastole::rig {

/// A hose of constant bore. The wall stores volume as A/(rho c^2) (p + creep e) a length, with e following p in the
/// creep time (a standard linear solid), and resists being stretched with wall_loss_s times the pressure's rate.
struct Hose {
  double length_m = 5.0;
  double bore_mm = 12.0;
  double density_kg_m3 = 1005.0;
  double viscosity_Pa_s = 1.0e-3;
  double wave_speed_m_s = 400.0;  ///< of the instantaneous, elastic response of wall and fluid
  double creep_fraction = 0.05;   ///< of the elastic compliance, added slowly
  double creep_time_s = 0.1;
  /// Damps waves of rate w by w^2 / 2 times this, 1/s (Kelvin and Voigt): 0.02/s at 20 Hz. With 1e-6 a recorded hold with gas at the pump
  /// keeps a reduced chi-square of 2.5 (1.02 as it is), with 1e-5 a sawtooth where nothing is hidden has a fifth more.
  double wall_loss_s = 2.5e-6;
  double inertance_factor = 1.0;  ///< the fluid's inertia over that of a plain tube of this bore
  double loss_coefficient = 1.5;  ///< K: entries and bends take K rho v |v| / 2
  double loss_at_cavity =
      2.0 / 3.0;         ///< part of K: a jet loses all its energy (1.0), an entry half of it (0.5)
  double brunone = 1.0;  ///< of the unsteady friction by dv/dt and dv/dx: part of what WallFriction says
  double zielke =
      0.0;  ///< of the one that remembers (boundary_layer.hpp): part of what a smooth round bore has

  [[nodiscard]] double area_mm2() const;
  /// rho L / A times the factor, kPa s^2/mL: pressure by acceleration of the flow.
  [[nodiscard]] double inertance() const;
  /// A L / (rho c^2), mL/kPa: volume taken at once by pressure.
  [[nodiscard]] double compliance_mL_per_kPa() const;
};

/// The wall's drag as a pressure gradient, for the mean speed over the bore.
///
/// Steady part: Darcy-Weisbach, f rho v |v| / (2 D), with f = 64/Re below Re 2000, Blasius 0.3164 Re^-1/4 above 4000,
/// and between them a mean of both whose weight is the smooth step 3 s^2 - 2 s^3 in Re.
/// Unsteady part: B. Brunone et al., as J. Vitkovsky et al. (2000) write it for both directions of flow,
/// k rho / 2 (dv/dt + c sign(v) |dv/dx|), k = sqrt(C*) / 2; C* is A. Vardy and J. Brown's shear decay coefficient,
/// 0.00476 where laminar, 7.41 / Re^log10(14.3 / Re^0.05) where turbulent, with the same weight between.
/// Forgetting: B* viscosity / (density radius^2), B* = Re^log10(15.29 / Re^0.0567) / 12.86 where turbulent (A. Vardy and J. Brown,
/// J. Sound Vib. 259 (2003) 1011).
class WallFriction {
 public:
  explicit WallFriction(const Hose& hose);

  [[nodiscard]] double steady_kPa_per_m(double speed_m_s) const;
  [[nodiscard]] double reynolds(double speed_m_s) const;

  /// The gradient at several places as it depends on dv/dt: still + by_rate dv/dt.
  struct Drag {
    std::vector<double> still_kPa_per_m;
    std::vector<double> by_rate;     ///< kPa s^2/m^2
    std::vector<double> forgetting;  ///< 1/s: how much faster turbulence wipes the layer's memory out

    void resize(size_t places);
  };
  /// At as many places as `drag` has; interpolated in Re, within 1e-4. `stretching` is dv/dx, 1/s.
  void set_drag(const double* speed_m_s, const double* stretching, Drag& drag) const;

 private:
  /// Between two of even steps of Re: the steady gradient's cubic in the place between them, and rho k / 2.
  struct Piece {
    double steady_kPa_per_m[4];  // NOLINT: read some hundred million times
    double inertia, inertia_rise;
    double forgetting, forgetting_rise;
  };
  void make_table();

  double density_, viscosity_, bore_m_, wave_speed_m_s_, brunone_;
  double to_place_;  ///< of a speed in the table
  std::vector<Piece> table_;
};

}  // namespace diastole::rig
