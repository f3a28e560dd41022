#pragma once
// What the fit needs of a mechanical model: the body's motion for material values and a cavity pressure, and
// its derivatives. ElasticMotion (elastic_motion.hpp) is the finite-element one.
//
// A motion is a node field of deformed positions over `mesh()` (mm). Each loaded frame has a slot, so that a
// model can start from the frame's last solution.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct MotionOutcome {
  std::optional<NodeField> position_mm;  ///< empty when no equilibrium was found
  std::string reason;                    ///< why not, as a sentence
};

struct MotionDerivatives {
  std::vector<NodeField> by_value;  ///< dx/d(value), one for each value
  NodeField by_pressure;            ///< dx/d(cavity pressure), mm/kPa
};

class MotionModel {
 public:
  virtual ~MotionModel() = default;

  [[nodiscard]] virtual const HermiteMesh& mesh() const = 0;
  /// How many values `solve` takes: one a whole parameter, one an element for a regional one.
  [[nodiscard]] virtual size_t value_count() const = 0;

  /// Equilibrium of slot's frame. Failure is an outcome.
  [[nodiscard]] virtual MotionOutcome solve(size_t slot, std::span<const double> values,
                                            double pressure_kPa) = 0;
  /// At the slot's last successful `solve`.
  [[nodiscard]] virtual MotionDerivatives derivatives(size_t slot) = 0;
};

}  // namespace diastole
