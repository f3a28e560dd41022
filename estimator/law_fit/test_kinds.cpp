#include "estimator/law_fit/test_kinds.hpp"

#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "protocol/contract/angle.hpp"

namespace diastole {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using std::numbers::pi;
using Controls = std::span<const double>;
using Predicted = std::optional<MatrixXd>;

constexpr double N_per_kPa_mm2 = 1e-3;

Matrix3d stretched(double first, double second) {
  return Eigen::Vector3d(first, second, 1 / (first * second)).asDiagonal();
}

/// One entry of each part of a stress, or what is made of it.
template <class Of>
RowVectorXd of_parts(const std::vector<Matrix3d>& parts, const Of& of) {
  RowVectorXd row(static_cast<Eigen::Index>(parts.size()));
  for (size_t i = 0; i < parts.size(); ++i)
    row[static_cast<Eigen::Index>(i)] = of(parts[i]);
  return row;
}

RowVectorXd tension(const std::vector<Matrix3d>& parts, Eigen::Index axis) {
  return of_parts(parts, [axis](const Matrix3d& s) { return s(axis, axis) - s(2, 2); });
}

/// Sum over a smooth integrand of several components; exact for polynomials of the degree 29.
template <class Integrand>
MatrixXd integral(double from, double to, MatrixXd zero, const Integrand& integrand) {
  using Rule = boost::math::quadrature::gauss<double, 15>;
  const double half = (to - from) / 2, middle = (to + from) / 2;
  for (size_t i = 0; i < Rule::abscissa().size(); ++i) {
    const double x = half * Rule::abscissa()[i], weight = half * Rule::weights()[i];
    zero += weight * integrand(middle + x);
    if (x != 0) zero += weight * integrand(middle - x);
  }
  return zero;
}

/// Where a function that rises through zero between two places does so, to the last bits; none if it does not.
template <class Function>
std::optional<double> root(const Function& function, double low, double high) {
  const double at_low = function(low), at_high = function(high);
  if (at_low == 0) return low;
  if (at_high == 0) return high;
  if (!(at_low < 0) || !(at_high > 0) || !std::isfinite(at_low) || !std::isfinite(at_high))
    return std::nullopt;
  std::uintmax_t most = 200;
  const auto ends = boost::math::tools::toms748_solve(function, low, high, at_low, at_high,
                                                      boost::math::tools::eps_tolerance<double>(50), most);
  return (ends.first + ends.second) / 2;
}

/// A law with directions contracts across as its stress there asks; what follows from that moves with the parameters, too.
Predicted uniaxial(const LawAt& law, Controls controls, double fibre_rad) {
  constexpr double slack = 0.05;  // Poisson's ratios from -1/2 to 3/2, and a little for stretches near one
  constexpr double step = 1e-5;
  const double stretch = controls[0], middle = -std::log(stretch) / 2;
  const auto tensions = [&](const LawAt& of, double log_across) {
    const auto parts = of.stress(stretched(stretch, std::exp(log_across)), fibre_rad);
    return std::pair(RowVectorXd(tension(parts, 0) / stretch), tension(parts, 1));
  };
  if (!law.needs_axes()) return tensions(law, middle).first;
  const LawAt plain = law.without_slopes();
  const double reach = 2 * std::abs(middle) + slack;
  const auto across =
      root([&](double at) { return tensions(plain, at).second[0]; }, middle - reach, middle + reach);
  if (!across) return std::nullopt;
  auto [along, beside] = tensions(law, *across);
  const auto above = tensions(plain, *across + step), below = tensions(plain, *across - step);
  const double follows = (above.first[0] - below.first[0]) / (above.second[0] - below.second[0]);
  along.tail(along.size() - 1) -= follows * beside.tail(beside.size() - 1);
  return along;
}

Predicted planar(const LawAt& law, Controls controls, double fibre_rad) {
  return tension(law.stress(stretched(controls[0], 1), fibre_rad), 0) / controls[0];
}

Predicted biaxial(const LawAt& law, Controls controls, double fibre_rad) {
  const auto parts = law.stress(stretched(controls[0], controls[1]), fibre_rad);
  MatrixXd both(2, static_cast<Eigen::Index>(parts.size()));
  both << tension(parts, 0) / controls[0], tension(parts, 1) / controls[1];
  return both;
}

RowVectorXd shear_stress(const LawAt& law, double shear, double fibre_rad) {
  Matrix3d f = Matrix3d::Identity();
  f(0, 1) = shear;
  return of_parts(law.stress(f, fibre_rad), [](const Matrix3d& s) { return s(0, 1); });
}

Predicted simple_shear(const LawAt& law, Controls controls, double fibre_rad) {
  return shear_stress(law, controls[0], fibre_rad);
}

Predicted torsion(const LawAt& law, Controls controls, double fibre_rad) {
  const double height_mm = controls[1], stretch = controls[2];
  const double turn_rad_mm = rad_per_deg * controls[3] / height_mm, narrowing = 1 / std::sqrt(stretch);
  const auto integrand = [&](double r_mm) -> MatrixXd {
    Matrix3d f = Eigen::Vector3d(stretch, narrowing, narrowing).asDiagonal();
    f(1, 0) = r_mm * turn_rad_mm;
    const auto parts = law.stress(f, fibre_rad);
    MatrixXd both(2, static_cast<Eigen::Index>(parts.size()));
    both << of_parts(parts, [&](const Matrix3d& s) { return 2 * pi * s(0, 1) * r_mm * r_mm; }),
        of_parts(parts, [&](const Matrix3d& s) { return pi * (2 * s(0, 0) - s(1, 1) - s(2, 2)) * r_mm; });
    return both;
  };
  return N_per_kPa_mm2 * integral(0, narrowing * controls[0],
                                  MatrixXd::Zero(2, static_cast<Eigen::Index>(law.parts())), integrand);
}

Predicted tube(const LawAt& law, Controls controls, double fibre_rad) {
  const double unloaded_mm = controls[0], stretch = controls[2], outer_mm = controls[3];
  const double inner2_mm2 = tube_inner_radius2_mm2(controls);
  const auto integrand = [&](double r_mm) -> MatrixXd {
    const double place_mm = std::sqrt(unloaded_mm * unloaded_mm + stretch * (r_mm * r_mm - inner2_mm2));
    const auto parts = law.stress(stretched(r_mm / place_mm, stretch), fibre_rad);
    MatrixXd both(2, static_cast<Eigen::Index>(parts.size()));
    both << of_parts(parts, [&](const Matrix3d& s) { return (s(0, 0) - s(2, 2)) / r_mm; }),
        of_parts(parts, [&](const Matrix3d& s) {
          return N_per_kPa_mm2 * pi * (2 * s(1, 1) - s(2, 2) - s(0, 0)) * r_mm;
        });
    return both;
  };
  return integral(std::sqrt(inner2_mm2), outer_mm, MatrixXd::Zero(2, static_cast<Eigen::Index>(law.parts())),
                  integrand);
}

/// The shear under this stress, both positive.
std::optional<double> shear_under(const LawAt& law, double stress_kPa) {
  constexpr int most_doublings = 60;
  const auto excess = [&](double shear) { return shear_stress(law, shear, 0)[0] - stress_kPa; };
  double high = 1e-3;
  for (int i = 0; i < most_doublings && excess(high) < 0; ++i)
    high *= 2;
  return root(excess, 0, high);
}

/// Its derivatives follow from that the stress is given: dk/dp = -(ds/dp) / (ds/dk).
Predicted rotational_shear(const LawAt& law, Controls controls, double) {
  constexpr double step = 1e-5;
  const double inner_mm = controls[0], height_mm = controls[2], moment_Nmm = controls[3];
  const LawAt plain = law.without_slopes();
  bool in_equilibrium = true;
  const auto integrand = [&](double r_mm) -> MatrixXd {
    const auto shear =
        shear_under(plain, std::abs(moment_Nmm) / (2 * pi * height_mm * r_mm * r_mm * N_per_kPa_mm2));
    in_equilibrium = in_equilibrium && shear;
    if (!shear) return MatrixXd::Zero(1, static_cast<Eigen::Index>(law.parts()));
    RowVectorXd row = shear_stress(law, *shear, 0);
    const double rise_kPa =
        (shear_stress(plain, *shear + step, 0)[0] - shear_stress(plain, *shear - step, 0)[0]) / (2 * step);
    row *= -1 / rise_kPa;
    row[0] = *shear;
    return row / r_mm;
  };
  const MatrixXd turn_rad =
      integral(inner_mm, controls[4], MatrixXd::Zero(1, static_cast<Eigen::Index>(law.parts())), integrand);
  if (!in_equilibrium) return std::nullopt;
  return MatrixXd(turn_rad * std::copysign(1 / rad_per_deg, moment_Nmm));
}

using Names = std::string_view;
constexpr std::array<Names, 2> uniaxial_columns{"stretch", "nominal_kPa"};
constexpr std::array<Names, 2> planar_columns{"planar_stretch", "nominal_kPa"};
constexpr std::array<Names, 4> biaxial_columns{"stretch_1", "stretch_2", "nominal_1_kPa", "nominal_2_kPa"};
constexpr std::array<Names, 2> simple_shear_columns{"shear", "shear_stress_kPa"};
constexpr std::array<Names, 6> torsion_columns{"cylinder_radius_mm", "cylinder_height_mm", "axial_stretch",
                                               "twist_deg",          "moment_Nmm",         "axial_force_N"};
constexpr std::array<Names, 6> tube_columns{"unloaded_inner_radius_mm",
                                            "unloaded_outer_radius_mm",
                                            "axial_stretch",
                                            "outer_radius_mm",
                                            "pressure_kPa",
                                            "axial_force_N"};
constexpr std::array<Names, 6> rotational_columns{"inner_radius_mm", "outer_radius_mm", "height_mm",
                                                  "moment_Nmm",      "radius_mm",       "rotation_deg"};

constexpr std::array<TestKind, 7> kinds{
    {{"uniaxial", "Uniaxial test", uniaxial_columns, 1, 2, 0, "the pull", false, uniaxial},
     {"planar", "Planar test", planar_columns, 1, 2, 0, "the pull to the held side", false, planar},
     {"biaxial", "Biaxial test", biaxial_columns, 2, 4, 0, "the first pull to the second", false, biaxial},
     {"simple-shear", "Simple shear", simple_shear_columns, 1, 2, 0, "the slide to the gap", false,
      simple_shear},
     {"torsion", "Torsion of a cylinder", torsion_columns, 4, 5, 3, "the axis to the circumference", false,
      torsion},
     {"tube", "Inflation of a tube", tube_columns, 4, 5, 3, "the circumference to the axis", false, tube},
     {"rotational-shear", "Rotational shear", rotational_columns, 5, 6, 4, "", true, rotational_shear}}};

}  // namespace

std::span<const TestKind> test_kinds() { return kinds; }

double tube_inner_radius2_mm2(std::span<const double> controls) {
  return controls[3] * controls[3] - (controls[1] * controls[1] - controls[0] * controls[0]) / controls[2];
}

}  // namespace diastole
