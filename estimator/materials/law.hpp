#pragma once
// A material law: strain energy W(C; parameters) per reference volume, its stress S = 2 dW/dC and tangent.
//
// The laws describe incompressible material. The solver adds the Lagrange term -p (J - 1), so a law's energy
// need not vanish at rest in stress: S(C = I) must be a multiple of the unit tensor (which p takes up).
// C = F^T F comes in material axes (symmetric_tensor.hpp): fibre first, so that an anisotropic law reads its
// fibre strain as C[0]; the solver turns C into those axes at every Gauss point and the stress back.
//
// To add a law: one file `estimator/materials/NAME.cpp` like neo_hookean.cpp (a struct with the energy
// templated on the scalar), one line in material_list.inc. Everything else follows from derivatives by dual
// numbers (energy_law.hpp); a hand-written fast path is optional and is tested against them.
//
// Units: kPa for energy density (mJ/cm^3), stress and tangent. Thread-safe: laws hold no state.

#include <span>
#include <string_view>
#include <vector>

#include "estimator/materials/symmetric_tensor.hpp"

namespace diastole {

/// One parameter of a law, as it is spelled in a study file.
struct LawParameter {
  std::string_view name;     ///< with unit: "C1_kPa"
  std::string_view meaning;  ///< for help and reports
  double above;              ///< values must exceed this
  double typical;            ///< a soft gel's or heart's; where the tests evaluate the law
};

struct MaterialResponse {
  SymmetricTensor<double> stress;  ///< second Piola-Kirchhoff, kPa
  TangentTensor tangent;           ///< kPa
};

class Law {
 public:
  virtual ~Law() = default;

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
