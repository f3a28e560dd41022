#pragma once
// The bench tests of tissue: what is set, what is measured, and what a law says of it. The material is incompressible.
//
//   test               first axes              motion
//   uniaxial           pull, across            diag(l, l2, 1/(l l2)), l2 such that nothing pulls across
//   planar             pull, held              diag(l, 1, 1/l): a wide strip, or pure shear
//   biaxial            pulls 1, 2              diag(l1, l2, 1/(l1 l2)), without shear
//   simple-shear       slide, gap              x1 = X1 + k X2
//   torsion            axis, circumference     a solid cylinder, stretched by l and turned by D a reference length
//   tube               circumference, axis     l (r^2 - ri^2) = R^2 - Ri^2, ends kept from turning
//   rotational-shear   turn, radius            circles turn by omega(R) (estimator/shear/shear_test.hpp)
//
//   nominal stress     P_i = (s_ii - s_33) / l_i
//   torsion            M = 2 pi int s_tz r^2 dr
//   tube               p = int (s_tt - s_rr) / r dr
//   axial force        N = pi int (2 s_zz - s_rr - s_tt) r dr: of a cylinder whose side is free; of a tube without what the
//                      pressure does on closed ends
//   rotational shear   s_tr(k) = M / (2 pi h r^2),  omega = int k / r dr from the inner radius on
//
// s is the Cauchy stress; no result depends on its pressure. R. S. Rivlin, Phil. Trans. R. Soc. A 242 (1949) 173; J. D. Humphrey,
// Cardiovascular Solid Mechanics (2002), ch. 7.

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string_view>

#include "estimator/law_fit/law_at.hpp"

namespace diastole {

struct TestKind {
  std::string_view name;
  std::string_view title;  ///< for a page
  /// What is set, then what is measured; the first one distinguishes the kinds.
  std::span<const std::string_view> columns;
  size_t controls;              ///< of the columns
  size_t needed;                ///< columns that a file must have; of the rest it may lack the last ones
  size_t abscissa;              ///< the control over which curves are drawn
  std::string_view fibre_from;  ///< from where to where `fibre_deg` counts; empty: only laws without axes
  bool measures_motion;         ///< what is measured falls with stiffness
  /// Rows are what is measured, all columns of them; columns are LawAt's parts. None where the law has no equilibrium.
  std::optional<Eigen::MatrixXd> (*predict)(const LawAt& law, std::span<const double> controls,
                                            double fibre_rad);
};

/// In the order of the table above.
std::span<const TestKind> test_kinds();

/// The tube's inner radius under load, mm, squared; not positive for an outer radius that it cannot have.
double tube_inner_radius2_mm2(std::span<const double> controls);

}  // namespace diastole
