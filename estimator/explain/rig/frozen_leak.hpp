#pragma once
// What a small leak past the seal does, without solving for it: the flow that it takes at the pressures that are there without
// it is missing from the piston's. To first order in the leak this is what the model shows with it, at a thirtieth of the time.

#include <memory>
#include <span>

#include "estimator/effects/effect.hpp"
#include "estimator/rig_fit/session_problem.hpp"

namespace diastole::explain {

class FrozenLeak {
 public:
  /// The pressures in the cylinder of this model.
  FrozenLeak(const rig::SessionProblem& problem, const rig::SessionModel& at);

  /// Of the leak mL/s that is the natural cubic spline of these values at these pressures. One parameter, its size.
  [[nodiscard]] std::shared_ptr<const Effect> of(std::span<const double> at_kPa,
                                                 std::span<const double> values_mL_s) const;

 private:
  struct Pressure {
    double start_s, step_s;
    std::vector<double> kPa;
  };
  std::shared_ptr<std::map<std::string, Pressure>> pressure_;  ///< by run
};

}  // namespace diastole::explain
