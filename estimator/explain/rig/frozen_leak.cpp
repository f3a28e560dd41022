#include "estimator/explain/rig/frozen_leak.hpp"

#include "estimator/expressions/curve.hpp"
#include "estimator/expressions/program.hpp"
#include "estimator/rig/sampled_signal.hpp"
#include "estimator/rig/simulation.hpp"

namespace diastole::explain {

FrozenLeak::FrozenLeak(const rig::SessionProblem& problem, const rig::SessionModel& at)
    : pressure_(std::make_shared<std::map<std::string, Pressure>>()) {
  const rig::RigModel model = problem.model(at);
  constexpr double step_s = 1.0 / 300.0;
  for (const rig::SessionRun& run : problem.session().runs) {
    const rig::PlantTrace plant = rig::simulate_plant(model, run.drive, {.step_s = step_s, .components = 3});
    (*pressure_)[run.drive.place.name] = {plant.start_s - model.drive_lag_s, plant.step_s, plant.pump_kPa};
  }
}

std::shared_ptr<const Effect> FrozenLeak::of(std::span<const double> at_kPa,
                                             std::span<const double> values_mL_s) const {
  expressions::Graph graph;
  const expressions::Curve curve =
      expressions::tabulated_curve({at_kPa.begin(), at_kPa.end()}, {values_mL_s.begin(), values_mL_s.end()},
                                   expressions::Unit{}, expressions::Unit{});
  const expressions::NodeId leak = curve.build(graph, graph.input(0));
  const auto program = std::make_shared<expressions::Program>(graph, std::vector{leak});
  EffectDeclaration declared{.id = "frozen-leak",
                             .title = "",
                             .port = Port::drive,
                             .equations = "",
                             .source = "",
                             .looks_like = "",
                             .revealed_by = ""};
  declared.parameters = {{"size", "", "", 0.0, 0.0, 2.0, 1.0}};
  declared.apply = [program, pressure = pressure_](EffectValues values, const EffectContext&,
                                                   rig::RigModel& model) {
    model.drive.emplace_back(
        [program, pressure, size = values[0]](rig::DriveTrace& trace, const rig::RunPlace& place) {
          const Pressure& in_cylinder = pressure->at(place.name);
          double lost_mL = 0.0;
          double before_mL_s = 0.0;
          for (size_t k = 0; k < trace.volume_mL.size(); ++k) {
            const double kPa =
                rig::sampled(in_cylinder.kPa, (trace.time_s(k) - in_cylinder.start_s) / in_cylinder.step_s);
            const double leak_mL_s = size * (*program)(&kPa);
            if (k > 0) lost_mL += 0.5 * trace.step_s * (leak_mL_s + before_mL_s);
            trace.volume_mL[k] -= lost_mL;
            trace.flow_mL_per_s[k] -= leak_mL_s;
            trace.acceleration_mL_per_s2[k] -= k > 0 ? (leak_mL_s - before_mL_s) / trace.step_s : 0.0;
            before_mL_s = leak_mL_s;
          }
        });
  };
  return std::make_shared<Effect>(std::move(declared));
}

}  // namespace diastole::explain
