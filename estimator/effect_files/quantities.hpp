#pragma once
// The quantities that an effect's formulas may speak of, and those that they may set. Formulas see them as inputs of a
// Graph, by the numbers of `In`; an effect's parameters follow from In::count on, then its states.

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

namespace diastole::effect_files {

/// What a formula may depend on, in the order of the inputs.
enum class In : size_t {
  t,
  t_session,
  t_since,
  phase,
  cycle,
  cycle_rate,
  p_atm,
  V_command,
  q_command,
  a_command,
  q_piston,
  p_pump,
  p,
  V,
  dV,
  V_max,
  q_hose,
  p_cavity,
  // The rig's constants, which may be set too.
  c_hose,
  L_hose,
  D_hose,
  rho_fluid,
  mu_fluid,
  inertance_factor,
  K_hose,
  creep_fraction,
  creep_time,
  wall_loss,
  drive_compliance,
  pump_gas,
  cavity_gas,
  gas_exponent,
  f0_catheter,
  zeta_catheter,
  volume_gain,
  count
};
constexpr size_t index_of(In in) { return static_cast<size_t>(in); }
inline constexpr size_t quantity_count = index_of(In::count);
inline constexpr In first_constant = In::c_hose;

struct QuantityText {
  std::string_view name;
  std::string_view unit;
  std::string_view meaning;
  double usual = 0.0;  ///< a constant's in the paper's rig; another's in the middle of a stroke
};

/// In the order of `In`. cycle_rate has no name: nobody asks for it.
inline constexpr std::array<QuantityText, quantity_count> quantities{
    {{"t", "s", "time since the run's start", 1.0},
     {"t_session", "s", "time since the session's first run began", 1.0},
     {"t_since", "s", "time since the moment at which it happens; only with change_points", 0.5},
     {"phase", "1", "part of the cycle that has passed, 0 to 1", 0.25},
     {"cycle", "1", "cycles done in the session, the running one in part", 0.25},
     {"", "1/s", "", 1.0},
     {"p_atm", "kPa", "atmospheric pressure", 101.325},
     {"V_command", "mL", "volume that the steps command", 20.0},
     {"q_command", "mL/s", "its rate", 50.0},
     {"a_command", "mL/s^2", "its acceleration", 100.0},
     {"q_piston", "mL/s", "flow that the piston displaces", 50.0},
     {"p_pump", "kPa", "pressure in the cylinder", 10.0},
     {"p", "kPa", "pressure before this effect", 5.0},
     {"V", "mL", "volume that the specimen has taken", 20.0},
     {"dV", "mL/s", "its rate", 50.0},
     {"V_max", "mL", "the largest so far in the session", 20.0},
     {"q_hose", "mL/s", "flow through the hose", 50.0},
     {"p_cavity", "kPa", "pressure in the cavity", 5.0},
     {"c_hose", "m/s", "speed of pressure waves in the hose", 400.0},
     {"L_hose", "m", "length of the hose", 5.0},
     {"D_hose", "mm", "bore of the hose", 12.0},
     {"rho_fluid", "kg/m^3", "density of the fluid", 1005.0},
     {"mu_fluid", "Pa s", "viscosity of the fluid", 1e-3},
     {"inertance_factor", "1", "the fluid's inertia over that of a plain tube", 1.0},
     {"K_hose", "1", "loss coefficient of the hose's ends", 1.5},
     {"creep_fraction", "1", "part of the wall's compliance that comes late", 0.05},
     {"creep_time", "s", "by so much", 0.1},
     {"wall_loss", "s", "damping of the wall", 2.5e-6},
     {"drive_compliance", "mL/kPa", "by which screw and cylinder yield"},
     {"pump_gas", "mL", "gas between piston and hose, at rest"},
     {"cavity_gas", "mL", "gas beside the specimen, at rest"},
     {"gas_exponent", "1", "n of p V^n", 1.2},
     {"f0_catheter", "Hz", "resonance of the catheter", 60.0},
     {"zeta_catheter", "1", "its damping", 0.6},
     {"volume_gain", "1", "of gated volumes", 1.0}}};

/// What an effect may set besides the rig's constants.
enum class Out { V_piston, q_hose, p_pump, p, q_cavity, p_seen, t_seen };
inline constexpr size_t law_count = 7;

struct LawText {
  std::string_view name;
  std::string_view unit;
  std::string_view port;
  std::string_view meaning;
  std::span<const In> inputs;  ///< besides times, cycle and the rig's constants
};

namespace inputs_of {
inline constexpr std::array V_piston{In::V_command, In::q_command, In::a_command};
inline constexpr std::array q_hose{In::q_piston, In::p_pump};
inline constexpr std::array p_pump{In::p_pump, In::q_hose, In::V};
inline constexpr std::array p{In::p, In::V, In::dV, In::V_max};
inline constexpr std::array q_cavity{In::q_hose, In::p_cavity};
inline constexpr std::array p_seen{In::p};
}  // namespace inputs_of

/// In the order of `Out`.
inline constexpr std::array<LawText, law_count> laws{
    {{"V_piston", "mL", "drive", "volume that the piston displaces", inputs_of::V_piston},
     {"q_hose", "mL/s", "drive", "flow into the hose: q_piston less a leak", inputs_of::q_hose},
     {"p_pump", "kPa", "drive", "pressure in the cylinder: p_pump and what is lost into the hose",
      inputs_of::p_pump},
     {"p", "kPa", "specimen", "pressure of the specimen", inputs_of::p},
     {"q_cavity", "mL/s", "specimen", "flow into the specimen: q_hose less a leak", inputs_of::q_cavity},
     {"p_seen", "kPa", "sensor", "what the cavity's sensor shows", inputs_of::p_seen},
     {"t_seen", "s", "clock", "time of what is shown at t", {}}}};

/// At which port a constant of the rig is.
constexpr std::string_view port_of(In constant) {
  if (constant == In::cavity_gas || constant == In::gas_exponent) return "specimen";
  return constant >= In::f0_catheter ? "sensor" : "drive";
}

}  // namespace diastole::effect_files
