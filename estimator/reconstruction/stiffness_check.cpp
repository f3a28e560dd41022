#include "estimator/reconstruction/stiffness_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimator/model/affected_model.hpp"
#include "estimator/model/study_model.hpp"

namespace diastole {
namespace {

constexpr double slack = 1.3;  // beyond the bounds, for what the start values' curve is off
constexpr int attempts = 6, refinements = 4;

struct PressureUnit {
  const char* name;
  double a_kPa;  ///< how many make one kPa
};
constexpr std::array<PressureUnit, 6> pressure_units{{{"mmHg", 7.50062},
                                                      {"cmH2O", 10.1972},
                                                      {"Pa", 1000.0},
                                                      {"mbar", 10.0},
                                                      {"psi", 0.145038},
                                                      {"bar", 0.01}}};

const StudyParameter* stiffness_parameter(const Study& study) {
  for (const StudyParameter& parameter : study.law.parameters) {
    if (is_modulus(study, parameter)) return &parameter;
  }
  return nullptr;
}

}  // namespace

std::optional<ApparentStiffness> apparent_stiffness(const Study& study, const FieldForms& forms,
                                                    const FrameField& field) {
  // The pressure moved a body that was loaded before, by how much depends on the law: nothing to compare with.
  if (study.imaged_at || stiffness_parameter(study) == nullptr || !(field.load.pressure_kPa > 0)) return {};
  ElasticModel model = make_affected_model(study);
  const double gain = field_change_of(study).displacement_gain;
  const Eigen::VectorXd seen = forms.space.unknowns_of(field.displacement_mm);
  const Eigen::VectorXd along = forms.quadratic.times(forms.sobolev.mean_square, seen);
  const double size = seen.dot(along);
  if (!(size > 0)) return {};
  const auto amplitude = [&](const ElasticState& state) {
    NodeField moved = state.position_mm;
    for (size_t dof = 0; dof < moved.size(); ++dof)
      moved[dof] = gain * (moved[dof] - model.mesh().reference()[dof]);
    return along.dot(forms.space.unknowns_of(moved)) / size;
  };

  double pressure_kPa = field.load.pressure_kPa / 8.0;
  Solution solution = model.solve(pressure_kPa);
  for (int attempt = 0; attempt < attempts && !solution.report.converged(); ++attempt)
    solution = model.solve(pressure_kPa /= 4.0);
  if (!solution.report.converged()) return {};
  double reached = amplitude(solution.state);
  if (!(reached > 0)) return {};
  double needed_kPa = pressure_kPa / reached;
  // Secants from rest's straight line on; each at most three times as far as the motion that is known.
  for (int round = 0; round < refinements && std::abs(reached - 1.0) > 0.05; ++round) {
    const double next_kPa = std::clamp(needed_kPa, pressure_kPa / 3.0, pressure_kPa * 3.0);
    const Solution next = model.solve(next_kPa, solution.state);
    if (!next.report.converged()) break;
    const double now = amplitude(next.state);
    if (!(now > 0)) break;
    const double slope = (now - reached) / (next_kPa - pressure_kPa);
    needed_kPa = slope > 0 ? std::max(next_kPa + (1.0 - now) / slope, 0.1 * next_kPa) : next_kPa / now;
    solution = next;
    pressure_kPa = next_kPa;
    reached = now;
  }
  ApparentStiffness apparent{field.load.pressure_kPa / needed_kPa, {1.0, 1.0}};
  for (const StudyParameter& parameter : study.law.parameters) {
    if (!is_modulus(study, parameter) || !(parameter.start > 0)) continue;
    apparent.allowed[0] = std::min(apparent.allowed[0], parameter.lower / parameter.start);
    apparent.allowed[1] = std::max(apparent.allowed[1], parameter.upper / parameter.start);
  }
  return apparent;
}

std::optional<Finding> pressure_unit_finding(const Study& study, const ApparentStiffness& apparent) {
  const StudyParameter& parameter = *stiffness_parameter(study);
  const auto possible = [&](double ratio) {
    return ratio > apparent.allowed[0] / slack && ratio < apparent.allowed[1] * slack;
  };
  if (possible(apparent.ratio)) return {};
  const std::string name = parameter.name.substr(0, parameter.name.size() - 4);
  Finding finding{Severity::error,
                  "pressure-unit",
                  fmt::format("Pressures and motion together ask for a {} of about {:.2g} kPa, far outside "
                              "its bounds ({:g} to {:g} kPa).",
                              name, apparent.ratio * parameter.start, parameter.lower, parameter.upper),
                  "column pressure_kPa",
                  apparent.ratio * parameter.start,
                  "kPa",
                  "Check the pressures' unit and gain, the lengths' unit, and the parameter's bounds."};
  std::string guesses;
  for (const PressureUnit& unit : pressure_units) {
    if (!possible(apparent.ratio / unit.a_kPa)) continue;
    guesses +=
        fmt::format("{}in {} ({} would be about {:.2g} kPa: divide by {:g})", guesses.empty() ? "" : ", or ",
                    unit.name, name, apparent.ratio / unit.a_kPa * parameter.start, unit.a_kPa);
  }
  if (!guesses.empty())
    finding.remedy = "The pressures may be " + guesses + ". If their unit is right, widen the bounds.";
  return finding;
}

}  // namespace diastole
