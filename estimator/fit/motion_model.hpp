#pragma once
// What a fit asks of a mechanical model.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "estimator/io/study.hpp"
#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct MotionOutcome {
  std::optional<NodeField> position_mm;  ///< empty when no equilibrium was found
  std::string reason;                    ///< why not, as a sentence
};

struct MotionDerivatives {
  std::vector<NodeField> by_value;  ///< dx/d(value), one for each value
  NodeField by_pressure;            ///< dx/d(cavity pressure), mm/kPa
  NodeField by_imaged_pressure{};   ///< dx/d(imaged_load's pressure); empty for a model that has none
};

/// What one standard deviation of an error that is no unknown does to a frame (considered_errors.hpp).
struct ConsideredMotion {
  std::string source;
  NodeField by_motion;          ///< of the deformed positions, mm
  NodeField by_reference;       ///< of the undeformed ones
  double stored_energy_mJ = 0;  ///< of what is stored since frame 0
};

/// Total derivatives of what the body has stored since frame 0, mJ.
struct EnergyDerivatives {
  std::vector<double> by_value;
  double by_pressure = 0;
  double by_imaged_pressure = 0;
};

/// What the fit needs of a mechanical model: the body's motion for material values and a cavity pressure, and its
/// derivatives. ElasticMotion (elastic_motion.hpp) is the finite-element one.
///
/// A motion is a node field of deformed positions over `mesh()` (mm). Each loaded frame has a slot, so that a model can
/// start from the frame's last solution.
class MotionModel {
 public:
  virtual ~MotionModel() = default;

  [[nodiscard]] virtual const HermiteMesh& mesh() const = 0;

  /// The pressure at which `mesh()` was imaged, as measured, if the motion depends on it: one more unknown with a prior. `solve`
  /// takes it at the pressure last set.
  [[nodiscard]] virtual std::optional<ImagedLoad> imaged_load() const { return {}; }
  virtual void set_imaged_pressure(double /*pressure_kPa*/) {}

  /// Equilibrium of slot's frame. Failure is an outcome.
  [[nodiscard]] virtual MotionOutcome solve(size_t slot, std::span<const double> values,
                                            double pressure_kPa) = 0;
  /// At the slot's last successful `solve`.
  [[nodiscard]] virtual MotionDerivatives derivatives(size_t slot) = 0;
  /// `solve` of slots 0, 1, ... at these pressures; may end after the first frame without an equilibrium. A model may work on several
  /// frames at the same time, and so prepare the derivatives of all that were solved.
  [[nodiscard]] virtual std::vector<MotionOutcome> solve_all(std::span<const double> values,
                                                             std::span<const double> pressures_kPa);
  virtual void prepare_derivatives() {}
  /// What the body has stored since frame 0, and its derivatives; likewise. Throw std::logic_error in a model that has no energy.
  [[nodiscard]] virtual double stored_energy_mJ(size_t slot);
  [[nodiscard]] virtual EnergyDerivatives energy_derivatives(size_t slot);
  /// Of each such error, in the same order for all slots; likewise.
  [[nodiscard]] virtual std::vector<ConsideredMotion> considered(size_t /*slot*/) { return {}; }
};

}  // namespace diastole
