#pragma once
// What field effects change: a specimen as images of it show it. The default values are the base model: a neo-Hookean annulus
// whose ends are held (estimator/explain/imaging/field_solver.hpp solves it), or any other specimen as its study describes it
// (estimator/model/changed_specimen.hpp).

#include <array>
#include <optional>

namespace diastole {

/// Material of another stiffness within an ellipsoid whose axes point outwards, around and along z.
///
///   C1(X) = C1 (1 + (contrast - 1) (1 - tanh((rho - 1) a / width)) / 2),   rho^2 = sum (x_i / a_i)^2,   a = mean a_i
struct Inclusion {
  double contrast = 1.0;
  double radius_mm = 0.0;  ///< of the centre, from the annulus axis
  double z_mm = 0.0;
  double theta_deg = 0.0;
  std::array<double, 3> semi_axes_mm{};  ///< radial, tangential, axial
  double edge_width_mm = 2.0;

  /// C1(X) / C1.
  [[nodiscard]] double stiffness(const std::array<double, 3>& X_mm) const;

  friend bool operator==(const Inclusion&, const Inclusion&) = default;
};

struct FieldModel {
  double inner_radius_mm = 22.5;
  double outer_radius_mm = 50.0;
  double height_mm = 85.0;
  double beta = 0.0;    ///< W = C1/beta (exp(beta (I1 - 3)) - 1) + k1/(2 k2) (exp(k2 (I4 - 1)^2) - 1)
  double k1_kPa = 0.0;  ///< fibres,
  double k2 = 0.0;
  double fibre_angle_deg = 0.0;  ///< from the circumference towards z
  /// The ends' traction across z for a displacement there, while the plates hold them along z; none: they are held.
  std::optional<double> bond_stiffness_kPa_per_mm = {};
  double chamber_stiffness_kPa_per_mL = 0.0;  ///< pressure around the specimen for volume taken by it
  std::optional<Inclusion> inclusion = {};
  double displacement_gain = 1.0;  ///< displacement as imaged over the true one

  // Of specimens other than that annulus.
  double fibre_turn_deg = 0.0;       ///< of the fibres about the wall's normal, everywhere alike
  double fibre_course_deg = 0.0;     ///< the same at the inner wall, reversed at the outer one
  double opening_angle_deg = 0.0;    ///< at which a ring cut through opens: residual stress
  double pressure_offset_kPa = 0.0;  ///< frames' pressures as measured less the true ones
  std::array<double, 3> base_motion_mm_per_kPa{};  ///< of all of the body in the images

  friend bool operator==(const FieldModel&, const FieldModel&) = default;
};

}  // namespace diastole
