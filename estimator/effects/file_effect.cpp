#include "estimator/effects/file_effect.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "estimator/effects/file_states.hpp"
#include "estimator/expressions/program.hpp"

namespace diastole {
namespace {

using effect_files::EffectFile;
using effect_files::In;
using effect_files::index_of;
using effect_files::Out;
using expressions::Graph;
using expressions::NodeId;
using expressions::Operation;
using expressions::Program;

/// A number of the model that a constant of the files stands for.
double* constant_of(rig::RigModel& model, In in) {
  switch (in) {
    case In::c_hose:
      return &model.hose.wave_speed_m_s;
    case In::L_hose:
      return &model.hose.length_m;
    case In::D_hose:
      return &model.hose.bore_mm;
    case In::rho_fluid:
      return &model.hose.density_kg_m3;
    case In::mu_fluid:
      return &model.hose.viscosity_Pa_s;
    case In::inertance_factor:
      return &model.hose.inertance_factor;
    case In::K_hose:
      return &model.hose.loss_coefficient;
    case In::creep_fraction:
      return &model.hose.creep_fraction;
    case In::creep_time:
      return &model.hose.creep_time_s;
    case In::wall_loss:
      return &model.hose.wall_loss_s;
    case In::drive_compliance:
      return &model.drive_compliance_mL_per_kPa;
    case In::pump_gas:
      return &model.pump_gas_mL;
    case In::cavity_gas:
      return &model.cavity_gas_mL;
    case In::gas_exponent:
      return &model.gas_exponent;
    case In::f0_catheter:
      return &model.catheter.resonance_Hz;
    case In::zeta_catheter:
      return &model.catheter.damping;
    case In::volume_gain:
      return &model.volume_gain;
    default:
      return nullptr;
  }
}

/// The file's formulas as programs.
struct Laws {
  EffectFile file;
  Program constants;
  Program
      law;  ///< its value; of V_piston without memory its rate and acceleration too; of a leak what is lost
  NodeId lost = 0;         ///< of a leak past the seal
  Program conductance;     ///< of one that is nothing but that
  bool is_linear = false;  ///< it is one
  bool has_rates = false;  ///< V_piston's value, rate and acceleration
  bool uses_cycle = false;
  StatePrograms states;

  explicit Laws(EffectFile read);
  /// Whether the formula of what is lost past the seal holds anything with these values for the file's parameters.
  [[nodiscard]] bool leaks(std::span<const double> inputs) const;

 private:
  void read_law();
  NodeId rate_of(NodeId node);
};

bool any_depends(const Graph& graph, const std::vector<NodeId>& nodes, In in) {
  return std::ranges::any_of(nodes, [&](NodeId node) { return graph.depends_on(node, index_of(in)); });
}

/// By time, along the command.
NodeId Laws::rate_of(NodeId node) {
  Graph& graph = file.graph;
  constexpr std::array known{std::pair{In::V_command, In::q_command}, std::pair{In::q_command, In::a_command},
                             std::pair{In::phase, In::cycle_rate}, std::pair{In::cycle, In::cycle_rate}};
  NodeId rate = graph.number(0.0);
  for (const In time : {In::t, In::t_session, In::t_since})
    rate = graph.sum(rate, graph.derivative(node, index_of(time)));
  for (const auto& [of, by] : known)
    rate = graph.sum(rate, graph.product(graph.derivative(node, index_of(of)), graph.input(index_of(by))));
  return rate;
}

Laws::Laws(EffectFile read) : file(std::move(read)) {
  std::vector<NodeId> all;
  for (const auto& constant : file.constants)
    all.push_back(constant.node);
  if (!all.empty())
    effect_files::make_of_formula(file.file, file.constants.front().place,
                                  [&] { constants = Program(file.graph, all); });
  std::vector<NodeId> rates, initial;
  for (const auto& state : file.states) {
    rates.push_back(state.rate);
    initial.push_back(state.initial);
  }
  all.insert(all.end(), rates.begin(), rates.end());
  if (!file.laws.empty()) {
    all.push_back(file.laws.front().node);
    effect_files::make_of_formula(file.file, file.laws.front().place, [&] { read_law(); });
  }
  uses_cycle = any_depends(file.graph, all, In::phase) || any_depends(file.graph, all, In::cycle);
  if (!rates.empty())
    effect_files::make_of_formula(file.file, file.states.front().place, [&] {
      states = StatePrograms(file.graph, initial, rates, file.input_of_state(0));
    });
}

void Laws::read_law() {
  Graph& graph = file.graph;
  const NodeId node = file.laws.front().node;
  const Out sets = file.laws.front().sets;
  std::vector<NodeId> outputs{node};
  const NodeId none = graph.number(0.0);
  if (sets == Out::V_piston) {
    has_rates = file.states.empty() && !graph.depends_on(node, index_of(In::q_command)) &&
                !graph.depends_on(node, index_of(In::a_command));
    if (has_rates) outputs = {node, rate_of(node), rate_of(rate_of(node))};
  } else if (sets == Out::q_hose || sets == Out::q_cavity) {
    const In flow = sets == Out::q_hose ? In::q_piston : In::q_hose;
    const size_t pressure = index_of(sets == Out::q_hose ? In::p_pump : In::p_cavity);
    lost = graph.make(Operation::negate, graph.substituted(node, index_of(flow), none));
    const NodeId slope = graph.derivative(lost, pressure);
    outputs = {lost};
    is_linear = graph.is_number(graph.substituted(lost, pressure, none), 0.0);
    for (size_t i = 0; i < index_of(effect_files::first_constant); ++i)
      is_linear = is_linear && !graph.depends_on(slope, i);
    if (is_linear) conductance = Program(graph, std::vector{slope});
  } else if (sets == Out::t_seen) {
    outputs = {graph.substituted(node, index_of(In::t), none), graph.derivative(node, index_of(In::t))};
  }
  law = Program(graph, outputs);
}

bool Laws::leaks(std::span<const double> inputs) const {
  Graph graph = file.graph;
  NodeId left = lost;
  try {
    for (size_t i = file.input_of_parameter(0); i < file.input_of_state(0); ++i)
      left = graph.substituted(left, i, graph.number(inputs[i]));
  } catch (const std::logic_error&) {  // no finite number, or too long: whoever simulates it sees that
    return true;
  }
  return !graph.is_number(left, 0.0);
}

/// The laws with values for their parameters: what hooks of a model hold.
struct Bound {
  std::shared_ptr<const Laws> laws;
  std::vector<double> inputs;              ///< of a program, what varies left open
  std::optional<ChangePoint> moment = {};  ///< at which it happens

  double& operator[](In in) { return inputs[index_of(in)]; }

  [[nodiscard]] bool concerns(const rig::RunPlace& place) const {
    return !moment || laws->file.change_points == "one" || moment->run == place.name;
  }
  void set_time(double time_s, const rig::RunPlace& place) {
    (*this)[In::t] = time_s;
    (*this)[In::t_session] = place.started_s + time_s;
    (*this)[In::p_atm] = place.atmosphere_kPa;
    if (moment)
      (*this)[In::t_since] = laws->file.change_points == "one" ? place.started_s + time_s - moment->session_s
                                                               : time_s - moment->time_s;
    if (!laws->uses_cycle) return;
    const rig::CyclePlace at = rig::cycle_at(place, time_s);
    (*this)[In::phase] = at.phase;
    (*this)[In::cycle] = at.done;
    (*this)[In::cycle_rate] = at.rate_per_s;
  }
};

void drive(Bound bound, rig::DriveTrace& trace, const rig::RunPlace& place) {
  const Laws& laws = *bound.laws;
  States states(laws.states);
  for (size_t k = 0; k < trace.volume_mL.size(); ++k) {
    bound.set_time(trace.time_s(k), place);
    bound[In::V_command] = trace.volume_mL[k];
    bound[In::q_command] = trace.flow_mL_per_s[k];
    bound[In::a_command] = trace.acceleration_mL_per_s2[k];
    if (laws.has_rates) {
      std::array<double, 3> shown{};
      laws.law.run(bound.inputs.data(), shown.data());
      trace.volume_mL[k] = shown[0];
      trace.flow_mL_per_s[k] = shown[1];
      trace.acceleration_mL_per_s2[k] = shown[2];
      continue;
    }
    states.look(bound.inputs, trace.time_s(k));
    states.pass(bound.inputs, trace.time_s(k));
    trace.volume_mL[k] = laws.law(bound.inputs.data());
  }
  if (!laws.has_rates) trace.differentiate();
}

class FileMemory final : public rig::SpecimenMemory {
 public:
  FileMemory(Bound bound, const rig::RunPlace& place)
      : bound_(std::move(bound)),
        place_(place),
        states_(bound_.laws->states),
        largest_mL_(place.largest_before_mL) {}

  [[nodiscard]] double look(double elastic_kPa, double volume_mL, double time_s) const override {
    set(elastic_kPa, volume_mL, time_s);
    return bound_.laws->law(bound_.inputs.data());
  }
  void pass(double elastic_kPa, double volume_mL, double time_s) override {
    set(elastic_kPa, volume_mL, time_s);
    states_.pass(bound_.inputs, time_s);
    largest_mL_ = std::max(largest_mL_, volume_mL);
    volume_mL_ = volume_mL;
    time_s_ = time_s;
    begun_ = true;
  }

 private:
  void set(double elastic_kPa, double volume_mL, double time_s) const {
    bound_.set_time(time_s, place_);
    bound_[In::p] = elastic_kPa;
    bound_[In::V] = volume_mL;
    bound_[In::dV] = begun_ && time_s > time_s_ ? (volume_mL - volume_mL_) / (time_s - time_s_) : 0.0;
    bound_[In::V_max] = std::max(largest_mL_, volume_mL);
    states_.look(bound_.inputs, time_s);
  }

  mutable Bound bound_;  // what a look at a time sees there
  rig::RunPlace place_;
  mutable States states_;
  double largest_mL_;
  double volume_mL_ = 0.0, time_s_ = 0.0;
  bool begun_ = false;
};

/// What is lost at a pressure, as one leak of a run.
rig::LeakMaker leak_of(const Bound& bound, In pressure) {
  return [=](const rig::RunPlace& place) -> rig::LeakLaw {
    if (!bound.concerns(place)) return [](double, double) { return 0.0; };
    return [here = Bound(bound), place, pressure](double pressure_kPa, double time_s) mutable {
      here.set_time(time_s, place);
      here[pressure] = pressure_kPa;
      return here.laws->law(here.inputs.data());
    };
  };
}

void add_pump_leak(const Bound& bound, rig::RigModel& model) {
  const double conductance = bound.laws->is_linear ? bound.laws->conductance(bound.inputs.data()) : -1.0;
  if (conductance >= 0.0) {
    model.pump_leak_mL_s_kPa += conductance;
  } else if (bound.laws->leaks(bound.inputs)) {
    model.pump_leaks.push_back(leak_of(bound, In::p_pump));
  }
}

/// What is lost into the hose, as one law of a run.
rig::LossMaker loss_of(const Bound& bound) {
  return [=](const rig::RunPlace& place) -> rig::LossLaw {
    if (!bound.concerns(place)) return [](double, double, double) { return 0.0; };
    return [here = Bound(bound), place](double flow_mL_per_s, double volume_mL, double time_s) mutable {
      here.set_time(time_s, place);
      here[In::p_pump] = 0.0;
      here[In::q_hose] = flow_mL_per_s;
      here[In::V] = volume_mL;
      return here.laws->law(here.inputs.data());
    };
  };
}

void add_law(const Bound& bound, rig::RigModel& model) {
  if (bound.laws->file.laws.front().sets != Out::p_seen) model.has_corners = true;
  switch (bound.laws->file.laws.front().sets) {
    case Out::V_piston:
      // V_command is what was commanded: before the screw's own error.
      model.turns.emplace_back([bound](rig::DriveTrace& trace, const rig::RunPlace& place) {
        if (bound.concerns(place)) drive(bound, trace, place);
      });
      break;
    case Out::q_hose:
      add_pump_leak(bound, model);
      break;
    case Out::p_pump:
      model.pump_losses.push_back(loss_of(bound));
      break;
    case Out::p:
      model.memories.emplace_back(
          [bound](const rig::RunPlace& place) -> std::unique_ptr<rig::SpecimenMemory> {
            return std::make_unique<FileMemory>(bound, place);
          });
      break;
    case Out::q_cavity:
      model.cavity_leaks.push_back(leak_of(bound, In::p_cavity));
      break;
    case Out::p_seen:
      if (bound.laws->file.states.empty()) {
        model.cavity_sensor.emplace_back([bound](const rig::RunPlace& place) -> rig::SensorMap {
          if (!bound.concerns(place)) return [](double pressure_kPa, double) { return pressure_kPa; };
          return [here = Bound(bound), place](double pressure_kPa, double time_s) mutable {
            here.set_time(time_s, place);
            here[In::p] = pressure_kPa;
            return here.laws->law(here.inputs.data());
          };
        });
      } else {
        model.cavity_traces.emplace_back([bound](std::vector<double>& pressure_kPa, double start_s,
                                                 double step_s, const rig::RunPlace& place) {
          if (!bound.concerns(place)) return;
          Bound here = bound;
          States states(here.laws->states);
          for (size_t k = 0; k < pressure_kPa.size(); ++k) {
            const double time_s = start_s + step_s * static_cast<double>(k);
            here.set_time(time_s, place);
            here[In::p] = pressure_kPa[k];
            states.look(here.inputs, time_s);
            states.pass(here.inputs, time_s);
            pressure_kPa[k] = here.laws->law(here.inputs.data());
          }
        });
      }
      break;
    case Out::t_seen: {
      std::array<double, 2> clock{};  // at t = 0, and its rate
      bound.laws->law.run(bound.inputs.data(), clock.data());
      model.sample_delay_s -= clock[0];
      model.sample_skew -= clock[1] - 1.0;
      break;
    }
  }
}

void apply_file(const std::shared_ptr<const Laws>& laws, EffectValues values, const EffectContext& context,
                rig::RigModel& model) {
  const EffectFile& file = laws->file;
  Bound bound{laws, std::vector<double>(file.inputs(), 0.0)};
  for (size_t i = index_of(effect_files::first_constant); i < effect_files::quantity_count; ++i)
    bound.inputs[i] = *constant_of(model, static_cast<In>(i));
  std::ranges::copy(values, bound.inputs.begin() + static_cast<std::ptrdiff_t>(file.input_of_parameter(0)));
  std::vector<double> constants(file.constants.size());
  laws->constants.run(bound.inputs.data(), constants.data());
  for (size_t i = 0; i < constants.size(); ++i)
    *constant_of(model, file.constants[i].sets) = constants[i];
  if (file.laws.empty()) return;
  if (file.change_points == "none") return add_law(bound, model);
  for (const ChangePoint& moment : context.change_points) {
    bound.moment = moment;
    add_law(bound, model);
    if (file.change_points == "one") break;
  }
}

std::vector<double> neutral_values(const EffectFile& file, const rig::RigModel& base) {
  std::vector<double> values;
  rig::RigModel model = base;
  for (const auto& parameter : file.parameters)
    values.push_back(parameter.neutral_constant ? *constant_of(model, *parameter.neutral_constant)
                                                : parameter.neutral);
  return values;
}

SearchScale scale_of(const std::string& name) {
  if (name == "logarithmic") return SearchScale::logarithmic;
  return name == "inverse-square" ? SearchScale::inverse_square : SearchScale::linear;
}

Port port_named(const std::string& name) {
  for (const Port port : {Port::drive, Port::specimen, Port::sensor, Port::clock})
    if (name_of(port) == name) return port;
  return Port::field;
}

std::vector<std::string_view> views(const std::vector<std::string>& texts) {
  return {texts.begin(), texts.end()};
}

/// The texts that a declaration refers to belong to the laws, which outlive it.
EffectDeclaration declaration_of(const std::shared_ptr<const Laws>& laws) {
  const EffectFile& file = laws->file;
  EffectDeclaration declared{.id = file.id,
                             .title = file.title,
                             .port = port_named(file.port),
                             .equations = file.equations,
                             .source = file.source,
                             .looks_like = file.looks_like,
                             .revealed_by = file.reveals,
                             .conflicts = views(file.looks_alike),
                             .synergies = views(file.shows_with),
                             .changes = file.changes,
                             .learnt_from = views(file.learnt_from)};
  for (const auto& parameter : file.parameters)
    declared.parameters.push_back({parameter.name, parameter.unit, parameter.meaning, parameter.neutral,
                                   parameter.lower, parameter.upper, parameter.typical,
                                   scale_of(parameter.scale)});
  declared.change_points = file.change_points == "one"       ? ChangePoints::one
                           : file.change_points == "several" ? ChangePoints::several
                                                             : ChangePoints::none;
  declared.stage = file.port == "sensor" || file.port == "clock" ? Stage::sensors : Stage::plant;
  declared.keeps_modulus = file.keeps_modulus;
  declared.neutral = [laws](const rig::RigModel& base) { return neutral_values(laws->file, base); };
  declared.apply = [laws](EffectValues values, const EffectContext& context, rig::RigModel& model) {
    apply_file(laws, values, context, model);
  };
  return declared;
}

}  // namespace

std::shared_ptr<const Effect> make_file_effect(EffectFile file) {
  return std::make_shared<Effect>(declaration_of(std::make_shared<Laws>(std::move(file))));
}

std::shared_ptr<const Effect> read_effect(const std::filesystem::path& file) {
  return make_file_effect(effect_files::read_effect_file(file));
}

}  // namespace diastole
