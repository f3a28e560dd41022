#include "estimator/rig_fit/tolerance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "estimator/rig/relaxation.hpp"

namespace diastole::rig {
namespace {

/// Volume at which a specimen's curve is compared with another's.
constexpr double usual_mL = 36.0;

/// The value where it is positive, and ever nearer to zero beyond: searches need no corners. They differ by less than 0.7 of
/// `rounding`.
double positive(double value, double rounding) {
  const double x = value / rounding;
  return x > 30.0 ? value : rounding * std::log1p(std::exp(x));
}

/// An error of the drive so many times a turn of the screw, `sine` or cosine of that angle.
template <size_t times_a_turn, bool sine>
void add_turning_error(double size_mL, const EffectContext&, RigModel& model) {
  TurningError& error = model.turning_errors[times_a_turn - 1];
  (sine ? error.sine_mL : error.cosine_mL) += size_mL;
}

/// The specimen's pressure larger by `part` of it at usual_mL, in proportion to the volume to the power.
template <int power>
void bend_curve(double part, const EffectContext&, RigModel& model) {
  if (part == 0.0) return;
  std::vector<SpecimenCurve::Point> points = model.curve.points();
  for (SpecimenCurve::Point& at : points) {
    const double x = at.volume_mL / usual_mL;
    const double factor = part * std::pow(x, power);
    const double slope = part * power * std::pow(x, power - 1) / usual_mL;
    at.stiffness_kPa_per_mL += factor * at.stiffness_kPa_per_mL + slope * at.pressure_kPa;
    at.pressure_kPa *= 1.0 + factor;
  }
  model.curve = SpecimenCurve(std::move(points));
}

/// A part of the pressure relaxes within tenths of seconds, seconds or longer.
template <int decade>
void relax(double part, const EffectContext&, RigModel& model) {
  constexpr std::array times_s{0.1, 1.0, 10.0};
  add_relaxation(model, {{part, times_s[decade]}});
}

constexpr auto times = [](double& value, double logarithm) { value *= std::exp(logarithm); };

constexpr std::array tolerances{
    // Hose: cut and measured by hand; wall and losses from tables.
    Tolerance{"hose_length", "ln", 0.005, false, false,
              [](double x, const EffectContext&, RigModel& m) { times(m.hose.length_m, x); }},
    Tolerance{"hose_bore", "ln", 0.01, false, false,
              [](double x, const EffectContext&, RigModel& m) { times(m.hose.bore_mm, x); }},
    Tolerance{"hose_wave_speed", "ln", 0.1, false, false,
              [](double x, const EffectContext&, RigModel& m) { times(m.hose.wave_speed_m_s, x); }},
    Tolerance{"hose_minor_loss", "ln", 0.2, false, false,
              [](double x, const EffectContext&, RigModel& m) { times(m.hose.loss_coefficient, x); }},
    Tolerance{"hose_loss_at_cavity", "", 0.2, false, false,
              [](double x, const EffectContext&, RigModel& m) {
                constexpr double rounding = 0.02;
                const double part = m.hose.loss_at_cavity + x;
                m.hose.loss_at_cavity = positive(part, rounding) - positive(part - 1.0, rounding);
              }},
    Tolerance{"hose_wall_friction", "ln", 0.3, false, false,
              [](double x, const EffectContext&, RigModel& m) { times(m.hose.viscosity_Pa_s, x); }},
    // What the fluid near the wall adds to the inertia, as far as its memory is no unknown.
    Tolerance{"hose_inertance", "ln", 0.05, false, false,
              [](double x, const EffectContext&, RigModel& m) { times(m.hose.inertance_factor, x); }},
    // The model's friction knows dv/dt and not the past. A smooth round bore has all of Zielke's instead, which is 1.
    Tolerance{"hose_boundary_layer", "", 1.0, false, false,
              [](double x, const EffectContext&, RigModel& m) {
                if (x == 0.0) return;
                constexpr double rounding = 0.05;
                m.hose.brunone = positive(m.hose.brunone - x, rounding);
                m.hose.zielke += x;
              },
              IsUnknown::with_references},
    Tolerance{"hose_creep", "", 0.03, false, false,
              [](double x, const EffectContext&, RigModel& m) {
                m.hose.creep_fraction = positive(m.hose.creep_fraction + x, 0.005);
              }},
    Tolerance{"hose_creep_time", "ln", 0.7, false, false,
              [](double x, const EffectContext&, RigModel& m) { times(m.hose.creep_time_s, x); }},
    Tolerance{"hose_wall_loss", "ln", 1.0, false, false,
              [](double x, const EffectContext&, RigModel& m) { times(m.hose.wall_loss_s, x); }},
    // Drive. Beyond the lag that is described, motor and coupling, the instrument's filter and its scan over the channels
    // lag by some milliseconds each.
    Tolerance{"drive_lag", "s", 0.003, true, false,
              [](double x, const EffectContext&, RigModel& m) { m.sample_delay_s += x; }},
    Tolerance{"drive_stroke", "ln", 0.002, false, false,
              [](double x, const EffectContext&, RigModel& m) {
                if (x == 0.0) return;
                m.turns.emplace_back([factor = std::exp(x)](DriveTrace& trace, const RunPlace&) {
                  for (auto* values : {&trace.volume_mL, &trace.flow_mL_per_s, &trace.acceleration_mL_per_s2})
                    for (double& value : *values)
                      value *= factor;
                });
              }},
    Tolerance{"drive_compliance", "mL/kPa", 0.0015, false, false,
              [](double x, const EffectContext&, RigModel& m) {
                m.drive_compliance_mL_per_kPa = positive(m.drive_compliance_mL_per_kPa + x, 0.0005);
              }},
    Tolerance{"screw_sine", "mL", 0.02, false, false, add_turning_error<1, true>},
    Tolerance{"screw_cosine", "mL", 0.02, false, false, add_turning_error<1, false>},
    // A coupling between shafts that do not quite align errs twice a turn (Hooke's joint), by less than the screw.
    Tolerance{"coupling_sine", "mL", 0.01, false, false, add_turning_error<2, true>, IsUnknown::where_learnt},
    Tolerance{"coupling_cosine", "mL", 0.01, false, false, add_turning_error<2, false>,
              IsUnknown::where_learnt},
    // Gas, if there is any: between isothermal and adiabatic.
    Tolerance{"gas_exponent", "", 0.07, false, false,
              [](double x, const EffectContext&, RigModel& m) { m.gas_exponent += x; }},
    // Specimen: no gel is quite neo-Hookean or quite elastic, no mould quite round.
    Tolerance{"gel_curve", "at 36 mL", 0.01, false, false, bend_curve<1>},
    Tolerance{"gel_curvature", "at 36 mL", 0.005, false, false, bend_curve<2>},
    Tolerance{"gel_relaxation_fast", "", 0.015, false, false, relax<0>},
    Tolerance{"gel_relaxation_middle", "", 0.015, false, false, relax<1>},
    Tolerance{"gel_relaxation_slow", "", 0.015, false, false, relax<2>},
    Tolerance{"inner_radius", "", 0.005, false, true,
              [](double x, const EffectContext& context, RigModel& m) {
                context.change_specimen(m, Difference::inner_radius, std::clamp(x, -0.1, 0.1));
              }},
    // Instruments.
    Tolerance{"catheter_resonance", "ln", 0.1, true, false,
              [](double x, const EffectContext&, RigModel& m) { times(m.catheter.resonance_Hz, x); }},
    Tolerance{"catheter_damping", "ln", 0.15, true, false,
              [](double x, const EffectContext&, RigModel& m) { times(m.catheter.damping, x); }},
    Tolerance{"cavity_curvature", "at 20 kPa", 0.002, true, false,
              [](double x, const EffectContext&, RigModel& m) {
                if (x == 0.0) return;
                m.cavity_sensor.emplace_back([=](const RunPlace&) {
                  return [=](double p, double) { return p * (1.0 + x * p / 20.0); };
                });
              }},
    Tolerance{"volume_gain", "ln", 0.015, true, false,
              [](double x, const EffectContext&, RigModel& m) { times(m.volume_gain, x); }},
};

}  // namespace

std::span<const Tolerance> all_tolerances() { return tolerances; }

}  // namespace diastole::rig
