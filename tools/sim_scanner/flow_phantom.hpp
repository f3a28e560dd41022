#pragma once
// Pulsating flow through a straight tube in a block of still gel: Womersley's solution (J. Physiol. 127 (1955) 553) for the flow of a
// pump with a parabolic profile, each harmonic by itself:
//
//   u_n(r) = q_n / (pi a^2) (1 - J0(b r/a) / J0(b)) / (1 - 2 J1(b) / (b J0(b))),   b = i^(3/2) a sqrt(n omega / nu)

#include <complex>
#include <vector>

namespace diastole::scanner {

struct FlowPhantom {
  double bore_mm = 12.0;
  double wall_mm = 3.0;
  double block_radius_mm = 26.0;
  double stroke_mL = 20.0;
  double period_s = 1.2;
  double delay_s = 0.02;         ///< of the flow behind the trigger
  double viscosity_mm2_s = 1.0;  ///< water's at 20 degrees
  int harmonics = 12;            ///< of the parabolic profile that pass the hose
  double steady_mL_s = 0.0;      ///< of a leak: Poiseuille
  /// Any other flow instead of the pump's: the real part of the sum over n from 1 of course[n - 1] exp(i n omega t), mL/s.
  std::vector<std::complex<double>> course = {};

  /// Takes the course of the flow that makes a periodic volume, mL, known at times of a cycle: of (count - 1) / 2 harmonics, by least squares.
  /// Precondition: at least three times, without a gap of twice their mean distance.
  void follow(const std::vector<double>& times_s, const std::vector<double>& known_mL);

  [[nodiscard]] double flow_mL_s(double time_s) const;
  /// Above that at the trigger.
  [[nodiscard]] double volume_mL(double time_s) const;
  /// cm/s at radius r (0 at the wall and beyond) and a time; for many radii of one time see VelocityProfile.
  [[nodiscard]] double peak_cm_s() const;
};

/// Velocity by radius at one time, cm/s.
class VelocityProfile {
 public:
  VelocityProfile(const FlowPhantom& phantom, double time_s);
  [[nodiscard]] double at(double radius_mm) const;

 private:
  static constexpr int steps = 600;
  double radius_mm_;
  std::vector<double> values_;  // at even radii, the wall's the last
};

}  // namespace diastole::scanner
