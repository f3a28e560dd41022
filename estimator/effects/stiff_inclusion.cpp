// A stiffer or softer inclusion in the wall.

#include <array>
#include <cmath>

#include "estimator/effects/effect.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole {

double Inclusion::stiffness(const std::array<double, 3>& X_mm) const {
  const double theta = theta_deg * rad_per_deg;
  const std::array<double, 3> from_centre{
      (X_mm[0] * std::cos(theta) + X_mm[1] * std::sin(theta) - radius_mm) / semi_axes_mm[0],
      (X_mm[1] * std::cos(theta) - X_mm[0] * std::sin(theta)) / semi_axes_mm[1],
      (X_mm[2] - z_mm) / semi_axes_mm[2]};
  const double rho = std::hypot(from_centre[0], from_centre[1], from_centre[2]);
  const double mean_axis_mm = (semi_axes_mm[0] + semi_axes_mm[1] + semi_axes_mm[2]) / 3.0;
  return 1.0 + (contrast - 1.0) * 0.5 * (1.0 - std::tanh((rho - 1.0) * mean_axis_mm / edge_width_mm));
}

Effect stiff_inclusion_effect() {
  return {{
      .id = "stiff-inclusion",
      .title = "inclusion of another stiffness",
      .port = Port::field,
      .equations = "C1 is larger by the factor contrast (below 1: softer) within an ellipsoid, its edge "
                   "graded over 2 mm (field_model.hpp).",
      .source = "Geometry; J. D. Eshelby, Proc. R. Soc. A 241 (1957) 376 on what it does around it.",
      .looks_like = "Around one place the wall moves less (more, if soft) than on the opposite side, and "
                    "strains gather at its edge.",
      .revealed_by = "Denser tags and more frames at high pressure around the place; contrast and size trade "
                     "off in few data.",
      .field_parameters = {{"contrast", "", "its C1 over that around it", 1.0, 0.05, 30.0, 3.0,
                            SearchScale::logarithmic},
                           {"radius_mm", "mm", "of its centre, from the axis", 36.0, 10.0, 70.0, 36.0},
                           {"z_mm", "mm", "of its centre", 0.0, -60.0, 60.0, 5.0},
                           {"theta_deg", "deg", "of its centre", 0.0, -720.0, 720.0, 45.0},
                           {"semi_axis_radial_mm", "mm", "", 10.0, 3.0, 30.0, 10.0, SearchScale::logarithmic},
                           {"semi_axis_tangential_mm", "mm", "", 10.0, 3.0, 30.0, 10.0,
                            SearchScale::logarithmic},
                           {"semi_axis_axial_mm", "mm", "", 10.0, 3.0, 30.0, 10.0, SearchScale::logarithmic}},
      .field_essentials = 4,
      .field_shape = FieldShape::inclusion,
      .field_specimen = FieldSpecimen::any,
      .apply_to_field =
          [](EffectValues values, FieldModel& model) {
            if (values[0] == 1.0) return;
            model.inclusion = Inclusion{.contrast = values[0],
                                        .radius_mm = values[1],
                                        .z_mm = values[2],
                                        .theta_deg = values[3],
                                        .semi_axes_mm = {values[4], values[5], values[6]}};
          },
  }};
}

}  // namespace diastole
