#pragma once
// The discrete equations of an elastic body: residual, tangent and its factor, parameter derivatives.
// Elements are worked on in parallel, and summed colour by colour, so that the result does not depend on the
// number of threads.
//
// Unknowns: free displacement dofs, Lagrange pressures, the pressure in a sealed chamber, and last the cavity's
// pressure in states that hold its volume. The equations of the latter two are  - (V(x) - V_held) = 0  and, for a
// chamber's fluid,  - (V(x) - V(X)) - C (q - p0) = 0  (chamber.hpp).

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "estimator/fe/chamber.hpp"
#include "estimator/fe/elastic_state.hpp"
#include "estimator/fe/element_mechanics.hpp"
#include "estimator/fe/equation_system.hpp"
#include "estimator/fe/fluid_surface.hpp"
#include "estimator/fe/solve_report.hpp"
#include "estimator/fe/spring_bond.hpp"
#include "estimator/fe/tangent_factor.hpp"
#include "estimator/materials/law.hpp"
#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct SystemResidual {
  std::vector<double> values;   ///< dPi/d(unknown): kPa mm^2 for displacements, mm^3 for pressures
  double energy_uJ = 0.0;       ///< stored in the material
  double bond_energy_uJ = 0.0;  ///< stored in springs
  std::optional<InvertedPlace> inverted;
  std::optional<size_t> beyond_law;  ///< an element where the law has no energy
};

struct ElasticOptions {
  std::vector<double> parameters{};  ///< the law's, in its order; the same in all elements
  PressureSpace pressure_space = PressureSpace::per_element;
  std::optional<HeldDofs> held{};  ///< default: bottom and top faces held, or nothing if some are on springs
  std::vector<BondedFaces> bonded{};  ///< faces on springs, at plates z = const (spring_bond.hpp)
  std::optional<Chamber> chamber{};   ///< around the outer faces (chamber.hpp)
  /// Faces that the cavity pressure pushes on; default: the inner faces; see fluid_surface.hpp on free rims.
  std::optional<std::vector<ElementFace>> loaded{};
  MaterialAxesField material_axes{};         ///< default: the coordinate axes
  StiffnessField stiffness{};                ///< factor of the law's energy, not of K; default: 1 everywhere
  double volume_stiffness_kPa = 0.0;         ///< kappa of element_mechanics.hpp
  std::optional<double> bulk_modulus_kPa{};  ///< K of element_mechanics.hpp; default: incompressible
  SolveOptions solve{};                      ///< of ElasticModel
  size_t threads = 0;                        ///< 0: as many as the machine has
};

/// A state and how it was reached.
struct Solution {
  ElasticState state;  ///< the last converged one when the report says failure
  SolveReport report;
};

struct Stability {
  bool singular =
      false;  ///< some motion meets no resistance: a limit point, a bifurcation, or a missing support
  /// One for each pressure unknown, and for each motion that lowers the potential; of no account if singular.
  size_t negative_pivots = 0;
  /// Motions that lower it and keep the volume of the material. Others are spurious: eight pressures an element do not
  /// see all changes of volume, whose energy may be negative; as stiff as the material, they are gone. Not known if
  /// singular, nor where the cavity's wall has a free rim: its pressure has no potential.
  std::optional<size_t> unstable_motions{};

  [[nodiscard]] bool stable() const { return unstable_motions && *unstable_motions == 0; }
};

class ElasticSystem {
 public:
  ElasticSystem(HermiteMesh mesh, const Law& law, const ElasticOptions& options);

  [[nodiscard]] const HermiteMesh& mesh() const { return mesh_; }
  [[nodiscard]] const Law& law() const { return *law_; }
  [[nodiscard]] const EquationSystem& equations() const { return *equations_; }
  [[nodiscard]] const PressureMap& pressures() const { return pressures_; }
  [[nodiscard]] const MaterialAxesField& material_axes() const { return material_axes_; }
  /// As it was made with; without set_stiffness().
  [[nodiscard]] const StiffnessField& stiffness() const { return stiffness_; }
  [[nodiscard]] double volume_stiffness_kPa() const { return volume_stiffness_kPa_; }
  /// 1/K; 0 for incompressible material.
  [[nodiscard]] double compressibility_per_kPa() const { return compressibility_per_kPa_; }
  [[nodiscard]] std::span<double> parameters(size_t element) {
    return {&parameters_[element * count_], count_};
  }
  [[nodiscard]] std::span<const double> parameters(size_t element) const {
    return {&parameters_[element * count_], count_};
  }

  /// How many threads share the elements.
  void set_threads(size_t threads) { threads_ = threads; }
  /// Another stiffness of the material at an element's Gauss points; a factor is kept as it is.
  void set_stiffness(size_t element, const std::array<double, gauss_points>& stiffness);
  [[nodiscard]] const HeldDofs& held() const { return held_; }
  [[nodiscard]] bool on_springs(const ElementFace& face) const;

  [[nodiscard]] ElasticState rest_state() const;
  /// Whether the cavity has a volume: its wall's rim is held or at plates.
  [[nodiscard]] bool cavity_closed() const { return cavity_.closed(); }
  /// 0 for a wall with a free rim.
  [[nodiscard]] double cavity_volume_mm3(const ElasticState& state) const;
  [[nodiscard]] const std::optional<Chamber>& chamber() const { return chamber_; }
  /// Whether the chamber's fluid has a volume: the outer wall's rim is held or at plates.
  [[nodiscard]] bool chamber_closed() const { return chamber_wall_.closed(); }
  /// Volume that the specimen has taken from the fluid around it.
  [[nodiscard]] double chamber_intake_mm3(const ElasticState& state) const;
  /// Unknowns that have a negative pivot each at a stable equilibrium.
  [[nodiscard]] size_t pressure_unknowns(const ElasticState& state) const {
    return equations_->unknowns(state.held_volume_mm3.has_value()) - equations_->displacement_unknowns();
  }

  /// What an element sees of a state.
  [[nodiscard]] ElementState element_state(const ElasticState& state, size_t element) const;
  [[nodiscard]] SystemResidual residual(const ElasticState& state) const;
  /// Values of the stored entries of equations(), at a state: the symmetric part of the tangent. A probing stiffness
  /// (element_mechanics.hpp) resists changes of volume that the Lagrange pressures do not see.
  [[nodiscard]] std::vector<double> tangent(const ElasticState& state,
                                            double probing_stiffness_kPa = 0.0) const;
  /// The rest of it, where the cavity's wall has a free rim.
  [[nodiscard]] const RimSkew& rim_skew() const { return *skew_; }
  [[nodiscard]] std::vector<double> skew_tangent(const ElasticState& state) const;
  /// The cavity wall's area vectors, mm^2: minus the derivative of the residual with respect to the cavity
  /// pressure, and dV_cavity/d(unknown) if the cavity is closed.
  [[nodiscard]] std::vector<double> cavity_area(const ElasticState& state) const;
  /// The forces of equilibrium on all nodal dofs, held ones too, kPa mm^2.
  struct NodalForces {
    NodeField supports;  ///< what held dofs and springs exert on the body; zero at free dofs in equilibrium
    NodeField cavity;    ///< of the cavity's pressure
    NodeField chamber;   ///< of the chamber's pressure
  };
  [[nodiscard]] NodalForces nodal_forces(const ElasticState& state) const;
  /// d(residual)/d(parameter) summed over the elements of a group (empty: all), added to `target`.
  void add_parameter_residual(const ElasticState& state, size_t parameter, std::span<const size_t> elements,
                              std::span<double> target) const;

  /// Assembles and factorises the tangent; solve() uses it until the next call.
  FactorResult factorise(const ElasticState& state);
  void solve(std::span<double> right_sides, size_t count = 1) { factor_.solve(right_sides, count); }
  /// The factor that solve() uses, for later; none where it cannot be kept (tangent_factor.hpp).
  [[nodiscard]] std::shared_ptr<const CondensedFactor> kept_factor() const { return factor_.kept(); }
  /// Lets solve() use it, until the next factorisation.
  void use_factor(std::shared_ptr<const CondensedFactor> factor) { factor_.use(std::move(factor)); }
  /// Whether an equilibrium is stable, by the tangent's symmetric part; spoils the factor.
  Stability stability(const ElasticState& state);
  /// Numbers stored in the last factor: its fill.
  [[nodiscard]] size_t factor_entries() const { return factor_.entries(); }

  /// state + fraction * step over the unknowns.
  [[nodiscard]] ElasticState moved(const ElasticState& state, std::span<const double> step,
                                   double fraction) const;
  /// The displacement part of a vector over the unknowns, as a node field (zero at held dofs).
  [[nodiscard]] NodeField node_field(std::span<const double> unknowns) const;

 private:
  [[nodiscard]] double rest_pressure_kPa(size_t element) const;
  /// The largest over the elements: pressure at rest and stiffness against stretch there.
  [[nodiscard]] double material_stiffness_kPa() const;
  FactorResult inertia(const ElasticState& state, double probing_stiffness_kPa);
  /// Adds factor * area vectors of a fluid's surface.
  void add_area(const FluidSurface& surface, const NodeField& position_mm, double factor,
                std::span<double> target) const;
  void add_fluids(const ElasticState& state, std::span<double> residual) const;
  void add_fluid_rows(const ElasticState& state, std::span<double> values) const;
  void add_springs(const ElasticState& state, SystemResidual& total) const;

  /// A face on springs: force = stiffness times displacement over the face's coefficients.
  struct SpringFace {
    ElementFace face;
    FaceTangent stiffness;
  };

  HermiteMesh mesh_;
  const Law* law_;
  size_t count_;  // parameters of the law
  std::vector<double> parameters_;
  PressureMap pressures_;
  HeldDofs held_;
  FluidSurface cavity_;
  FluidSurface chamber_wall_;
  std::optional<Chamber> chamber_;
  double undeformed_chamber_mm3_ = 0.0;
  std::vector<SpringFace> springs_;
  MaterialAxesField material_axes_;
  StiffnessField stiffness_;
  double volume_stiffness_kPa_;
  double compressibility_per_kPa_;
  size_t threads_;
  std::shared_ptr<const EquationSystem> equations_;
  std::shared_ptr<const RimSkew> skew_;
  std::vector<ReferenceElement> reference_;
  TangentFactor factor_;
};

}  // namespace diastole
