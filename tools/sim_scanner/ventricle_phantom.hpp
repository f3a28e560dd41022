#pragma once
// A ventricle whose walls are known everywhere, and clicks on them: what `diastole lv` is tested with. It shares no shape with
// the estimator: walls are ellipsoids of revolution, bent by waves around and along, that shorten and thicken over a beat.
//
//   depth t (0 endocardium, 1 epicardium), angle theta around, psi from the apex (0) upwards:
//     R = (a + t b) (1 - shortening_t) sin psi (1 + sum of waves (p cos(n theta) + q sin(n theta)) sin^n(psi)),  z = -(c + t d) cos psi
//   the base is the plane z = base + tilt . (x, y); all in the phantom's own axes, turned and moved into the patient
//
// Clicks are a scanner's: short-axis slices 8 mm apart, not quite across the axis, and three long-axis slices; errors lie in the
// images' planes. Everything follows from the seed.

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace diastole::scanner {

struct VentriclePhantom {
  double inner_across_mm = 22, inner_along_mm = 54;  ///< a, c
  double wall_across_mm = 9, wall_along_mm = 8;      ///< b, d
  double base_mm = 15;
  double base_fall_mm = 6;  ///< of the base, at the end of the beat's contraction
  Eigen::Vector2d base_tilt{0.05, -0.03};
  std::array<Eigen::Vector2d, 3> waves{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(),
                                       Eigen::Vector2d::Zero()};  ///< (p, q) of n = 1, 2, 3
  double shortening = 0.2;                                        ///< of the endocardium across
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();

  /// Sizes, waves and pose at random, in the range of pigs' and people's.
  static VentriclePhantom random(std::uint64_t seed);

  /// `activity` from 0 (filled) to 1 (contracted); patient coordinates.
  [[nodiscard]] Eigen::Vector3d place_mm(double t, double theta, double psi, double activity) const;
  /// Where the meridian meets the base.
  [[nodiscard]] double base_psi(double t, double theta, double activity) const;
  [[nodiscard]] double cavity_mL(double activity) const;
  /// Points of a wall below the base, evenly in theta and psi.
  [[nodiscard]] std::vector<Eigen::Vector3d> surface_mm(double t, double activity) const;

 private:
  [[nodiscard]] Eigen::Vector3d own_place_mm(double t, double theta, double psi, double activity) const;
  [[nodiscard]] double above_base_mm(const Eigen::Vector3d& own_mm, double activity) const;
  friend struct Clicker;
};

struct ClickProtocol {
  int phases = 1;
  double sigma_mm = 0.5;
  int clicks = 9;  ///< on each wall of each slice
  double shift_mm =
      0;  ///< breath holds: each short-axis slice is displaced in its plane by so much, somewhere
  bool base_points = true;
  std::uint64_t seed = 1;
};

struct Clicks {
  std::string guide_csv;         ///< phase,slice,surface,x_mm,y_mm,z_mm,sigma_mm
  std::vector<double> activity;  ///< of each phase
  std::vector<std::string> slices;
  std::vector<Eigen::Vector3d> shifts_mm;  ///< of each slice
};

Clicks click(const VentriclePhantom& phantom, const ClickProtocol& protocol);

}  // namespace diastole::scanner
