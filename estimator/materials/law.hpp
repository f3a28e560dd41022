#pragma once
// A material law: strain energy W(C; parameters) per reference volume, its stress S = 2 dW/dC and tangent.
//
// The laws describe incompressible material. The solver adds the Lagrange term -p (J - 1), so a law's energy
// need not vanish at rest in stress: S(C = I) must be a multiple of the unit tensor (which p takes up).
// C = F^T F comes in material axes (SymmetricTensor): fibre first, so that an anisotropic law reads its
// fibre strain as C[0]; the solver turns C into those axes at every Gauss point and the stress back.
//
// To add a law: one file `estimator/materials/NAME.cpp` like neo_hookean.cpp (a struct with the energy
// templated on the scalar), one line in material_list.inc. Everything else follows from derivatives by dual
// numbers (energy_law.hpp); a hand-written fast path is optional and is tested against them.
//
// Units: kPa for energy density (mJ/cm^3), stress and tangent. Thread-safe: laws hold no state.

#include <Eigen/Dense>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

namespace diastole {

/// Symmetric 3x3 tensors by their six components, in material axes (f fibre, s sheet, n normal; for an
/// isotropic law any orthonormal axes):
///
///   index   0   1   2   3   4   5
///   entry   ff  ss  nn  fs  sn  nf          an off-diagonal entry is stored once and is not doubled
template <class Scalar>
using SymmetricTensor = std::array<Scalar, 6>;

/// C of a body at rest.
inline constexpr SymmetricTensor<double> undeformed{1.0, 1.0, 1.0, 0.0, 0.0, 0.0};

/// Material tangent dS/dE: entry (m, n) is the tensor component D_mn = 2 dS_m/dC_n, minor and major
/// symmetric.
using TangentTensor = Eigen::Matrix<double, 6, 6>;

inline constexpr std::array<std::array<size_t, 2>, 6> symmetric_entries{
    {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}}};
/// symmetric_index[i][j]: where entry ij is stored.
inline constexpr std::array<std::array<size_t, 3>, 3> symmetric_index{{{0, 3, 5}, {3, 1, 4}, {5, 4, 2}}};

template <class Scalar>
Scalar trace(const SymmetricTensor<Scalar>& a) {
  return a[0] + a[1] + a[2];
}

template <class Scalar>
Scalar determinant(const SymmetricTensor<Scalar>& a) {
  return a[0] * (a[1] * a[2] - a[4] * a[4]) - a[3] * (a[3] * a[2] - a[4] * a[5]) +
         a[5] * (a[3] * a[4] - a[1] * a[5]);
}

inline Eigen::Matrix3d full_matrix(const SymmetricTensor<double>& a) {
  Eigen::Matrix3d full;
  full << a[0], a[3], a[5], a[3], a[1], a[4], a[5], a[4], a[2];
  return full;
}

/// Takes the upper triangle.
inline SymmetricTensor<double> symmetric_part(const Eigen::Matrix3d& a) {
  return {a(0, 0), a(1, 1), a(2, 2), a(0, 1), a(1, 2), a(0, 2)};
}

/// One parameter of a law, as it is spelled in a study file.
struct LawParameter {
  std::string_view name;        ///< a built-in law's with its unit: "C1_kPa"
  std::string_view meaning;     ///< for help and reports
  double above;                 ///< values must exceed this
  double typical;               ///< a soft gel's or heart's; where the tests evaluate the law
  std::string_view unit = "1";  ///< pressures are in kPa
  double at_most = std::numeric_limits<double>::infinity();

  /// All of a law's moduli times a number are its stress times that number.
  [[nodiscard]] bool is_modulus() const { return unit == "kPa"; }
};

struct MaterialResponse {
  SymmetricTensor<double> stress;  ///< second Piola-Kirchhoff, kPa
  TangentTensor tangent;           ///< kPa
};

class Law {
 public:
  virtual ~Law() = default;

  /// The pressure that balances the law's stress at rest.
  [[nodiscard]] double rest_pressure_kPa(std::span<const double> parameters) const {
    return trace(stress(undeformed, parameters)) / 3.0;
  }

  [[nodiscard]] virtual std::string_view name() const = 0;
  /// Whether directions of the material matter: the energy of a body turned within its axes is another.
  [[nodiscard]] virtual bool needs_axes() const = 0;
  [[nodiscard]] virtual std::span<const LawParameter> parameters() const = 0;

  // `c` is the right Cauchy-Green tensor; `values` holds one number for each of parameters(), in that order.
  [[nodiscard]] virtual double energy(const SymmetricTensor<double>& c,
                                      std::span<const double> values) const = 0;
  [[nodiscard]] virtual SymmetricTensor<double> stress(const SymmetricTensor<double>& c,
                                                       std::span<const double> values) const = 0;
  [[nodiscard]] virtual MaterialResponse response(const SymmetricTensor<double>& c,
                                                  std::span<const double> values) const = 0;
  /// dS/d(values[parameter]) at fixed C.
  [[nodiscard]] virtual SymmetricTensor<double> stress_sensitivity(const SymmetricTensor<double>& c,
                                                                   std::span<const double> values,
                                                                   size_t parameter) const = 0;

  // The same by dual numbers alone, whatever fast path the law has: what the fast paths are tested against.
  [[nodiscard]] virtual MaterialResponse dual_response(const SymmetricTensor<double>& c,
                                                       std::span<const double> values) const = 0;
  [[nodiscard]] virtual SymmetricTensor<double> dual_stress_sensitivity(const SymmetricTensor<double>& c,
                                                                        std::span<const double> values,
                                                                        size_t parameter) const = 0;

  /// Index of a parameter by its name; parameters().size() if the law has none of that name.
  [[nodiscard]] size_t parameter_index(std::string_view parameter) const;
};

/// The laws of material_list.inc, in its order. They live as long as the program.
const std::vector<const Law*>& all_laws();

/// nullptr when no law has that name.
const Law* find_law(std::string_view name);

}  // namespace diastole
