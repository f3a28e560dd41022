#include "tools/sim_rig/hidden_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "estimator/effect_files/effect_file.hpp"
#include "estimator/expressions/program.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::sim_rig {
namespace {

using effect_files::EffectFile;
using effect_files::In;
using effect_files::index_of;
using effect_files::Out;
using expressions::NodeId;
using expressions::Operation;
using expressions::Program;

/// What of the plant a constant stands for; nullptr where it has none.
double* constant_of(PlantConfig& plant, In in) {
  switch (in) {
    case In::c_hose:
      return &plant.hose.wave_speed_m_s;
    case In::L_hose:
      return &plant.hose.length_m;
    case In::D_hose:
      return &plant.hose.bore_mm;
    case In::rho_fluid:
      return &plant.hose.fluid_density_kg_m3;
    case In::mu_fluid:
      return &plant.hose.fluid_viscosity_Pa_s;
    case In::inertance_factor:
      return &plant.hose.inertia_factor;
    case In::K_hose:
      return &plant.minor_loss_K;
    case In::creep_fraction:
      return &plant.hose.wall_creep_fraction;
    case In::creep_time:
      return &plant.hose.wall_creep_time_s;
    case In::drive_compliance:
      return &plant.flaws.pump.compliance_mL_per_kPa;
    case In::pump_gas:
      return &plant.flaws.pump.gas_mL;
    case In::cavity_gas:
      return &plant.flaws.cavity.gas_mL;
    case In::f0_catheter:
      return &plant.cavity.f0_Hz;
    case In::zeta_catheter:
      return &plant.cavity.zeta;
    default:
      return nullptr;
  }
}

[[noreturn]] void refuse(const EffectFile& file, const std::string& what) {
  throw InputError(
      {file.file, "option --hide", fmt::format("the simulated rig cannot have {}", what),
       "It takes constants of the rig, and laws of pressure, volume and time without states, phase and "
       "moments."});
}

/// A law as a program with its parameters' values.
struct Law {
  Program program;
  std::vector<double> inputs;

  [[nodiscard]] double at(double time_s, std::initializer_list<std::pair<In, double>> values) {
    inputs[index_of(In::t)] = inputs[index_of(In::t_session)] = time_s;
    for (const auto& [in, value] : values)
      inputs[index_of(in)] = value;
    return program(inputs.data());
  }
};

void put_law(EffectFile& file, std::vector<double> inputs, OwnLaws& own) {
  const Out sets = file.laws.front().sets;
  const NodeId node = file.laws.front().node;
  for (const In in : {In::phase, In::cycle, In::t_since, In::dV, In::V_max, In::q_command, In::a_command})
    if (file.graph.depends_on(node, index_of(in)))
      refuse(file, fmt::format("what depends on {}", effect_files::quantities[index_of(in)].name));
  if (!file.states.empty()) refuse(file, "states");
  const auto lost = [&](In flow) {
    return file.graph.make(Operation::negate,
                           file.graph.substituted(node, index_of(flow), file.graph.number(0.0)));
  };
  const auto law = [&](NodeId of) { return Law{Program(file.graph, std::vector{of}), inputs}; };
  switch (sets) {
    case Out::V_piston:
      own.piston_mL = [law = law(node)](double volume_mL, double time_s) mutable {
        return law.at(time_s, {{In::V_command, volume_mL}});
      };
      break;
    case Out::q_hose:
      own.pump_leak_mL_s = [law = law(lost(In::q_piston))](double pressure_kPa, double time_s) mutable {
        return law.at(time_s, {{In::p_pump, pressure_kPa}});
      };
      break;
    case Out::q_cavity:
      own.cavity_leak_mL_s = [law = law(lost(In::q_hose))](double pressure_kPa, double time_s) mutable {
        return law.at(time_s, {{In::p_cavity, pressure_kPa}});
      };
      break;
    case Out::p:
      own.specimen_kPa = [law = law(node)](double pressure_kPa, double volume_mL, double time_s) mutable {
        return law.at(time_s, {{In::p, pressure_kPa}, {In::V, volume_mL}});
      };
      break;
    case Out::p_seen:
      own.seen_kPa = [law = law(node)](double pressure_kPa, double time_s) mutable {
        return law.at(time_s, {{In::p, pressure_kPa}});
      };
      break;
    case Out::p_pump:
      refuse(file, "a loss at the pump");
    case Out::t_seen:
      refuse(file, "another clock");
  }
}

}  // namespace

bool is_effect_file(const std::string& id) { return id.ends_with(".toml"); }

HiddenFile hide_file(const std::string& name, Draw& draw) {
  EffectFile file = effect_files::read_effect_file(name);
  if (file.change_points != "none") refuse(file, "moments");
  constexpr double smallest = 0.5, largest = 2.0;  // of the typical size
  std::vector<double> inputs(file.inputs(), 0.0);
  for (size_t i = 0; i < effect_files::quantity_count; ++i)
    if (const double* constant = constant_of(draw.plant, static_cast<In>(i))) inputs[i] = *constant;
  inputs[index_of(In::gas_exponent)] = effect_files::quantities[index_of(In::gas_exponent)].usual;
  inputs[index_of(In::p_atm)] = AirBubble::atmospheric_kPa;
  for (size_t i = 0; i < file.parameters.size(); ++i) {
    const auto& parameter = file.parameters[i];
    double value = parameter.typical;
    if (i == 0) {
      const double size = draw.within(parameter.name, smallest, largest);
      value = std::clamp(parameter.neutral + size * (parameter.typical - parameter.neutral), parameter.lower,
                         parameter.upper);
    }
    draw.drawn[parameter.name] = inputs[file.input_of_parameter(i)] = value;
  }
  for (const auto& constant : file.constants) {
    double* of_plant = constant_of(draw.plant, constant.sets);
    if (of_plant == nullptr)
      refuse(file, std::string(effect_files::quantities[index_of(constant.sets)].name));
    *of_plant = Program(file.graph, std::vector{constant.node})(inputs.data());
  }
  draw.plant.hose.segments = std::max(draw.plant.hose.segments, segments_for(draw.plant.hose));
  if (!file.laws.empty())
    effect_files::make_of_formula(file.file, file.laws.front().place,
                                  [&] { put_law(file, std::move(inputs), draw.flaws.own); });
  return {file.id, file.port};
}

}  // namespace diastole::sim_rig
