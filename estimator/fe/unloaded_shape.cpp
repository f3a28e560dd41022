#include "estimator/fe/unloaded_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "estimator/mesh/node_field.hpp"
#include "estimator/mesh/placed_mesh.hpp"
#include "estimator/parallel/parallel_for.hpp"

namespace diastole {
namespace {

constexpr size_t coefficients = 3 * hermite_functions;
constexpr size_t element_unknowns = coefficients + corners;

/// Numbers of an element's equations: its coefficients 3 a + i, then its Lagrange pressures; `none` where held.
std::array<size_t, element_unknowns> equations_of(const ElasticSystem& system, size_t element) {
  std::array<size_t, element_unknowns> numbers;
  for (size_t a = 0; a < hermite_functions; ++a)
    for (size_t i = 0; i < 3; ++i)
      numbers[3 * a + i] = system.equations().equation(element, a, i);
  for (size_t m = 0; m < corners; ++m)
    numbers[coefficients + m] =
        system.equations().displacement_unknowns() + system.pressures().unknown[element][m];
  return numbers;
}

double scale_of(const HermiteMesh& mesh, size_t element, size_t local) {
  return local < coefficients ? mesh.scale(element, local / 3) : 1.0;
}

ElementField over_functions(const Eigen::Vector<double, coefficients>& values) {
  return Eigen::Map<const ElementField>(values.data());
}

/// A place in an element that is inside out between its Gauss points.
std::optional<InvertedPlace> fold_of(const HermiteMesh& unloaded, const HermiteMesh& imaged) {
  for (size_t e = 0; e < unloaded.element_count(); ++e) {
    constexpr std::array<double, 3> places{0.02, 0.5, 0.98};
    for (size_t sample = 0; sample < 27; ++sample) {
      const MaterialPoint point{e, {places[sample % 3], places[sample / 3 % 3], places[sample / 9]}};
      const double volume = unloaded.xi_gradient(unloaded.reference(), point).determinant();
      if (volume > 0.0) continue;
      const double loaded = imaged.xi_gradient(imaged.reference(), point).determinant();
      return InvertedPlace{point, imaged.value(imaged.reference(), point), volume / loaded};
    }
  }
  return {};
}

}  // namespace

std::string UnloadReport::describe() const {
  if (converged()) {
    return fmt::format("the shape without load was found in {} load steps and {} iterations", load_steps,
                       iterations);
  }
  std::string text =
      fmt::format("no shape without load: {} after {:g} kPa had been taken off",
                  reason == SolveReason::inverted_element ? "an element folds" : diastole::describe(reason),
                  reached_pressure_kPa);
  if (folded) {
    text +=
        fmt::format(", element {} at xi = ({:.2f}, {:.2f}, {:.2f}), imaged at ({:.2f}, {:.2f}, {:.2f}) mm",
                    folded->point.element, folded->point.xi[0], folded->point.xi[1], folded->point.xi[2],
                    folded->reference_mm[0], folded->reference_mm[1], folded->reference_mm[2]);
  }
  if (beyond_law) text += fmt::format(", at the strain of element {}", *beyond_law);
  return text;
}

InverseDesign::InverseDesign(const ElasticSystem& imaged)
    : imaged_(imaged), area_(imaged.cavity_area(imaged.rest_state())) {
  number_entries();
}

void InverseDesign::number_entries() {
  const HermiteMesh& mesh = imaged_.mesh();
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const auto numbers = equations_of(imaged_, e);
    for (size_t column = 0; column < element_unknowns; ++column) {
      for (size_t row = 0; row < element_unknowns; ++row) {
        if (numbers[row] == EquationSystem::none || numbers[column] == EquationSystem::none) continue;
        rows_.push_back(static_cast<int>(numbers[row] + 1));
        columns_.push_back(static_cast<int>(numbers[column] + 1));
      }
    }
  }
}

SystemResidual InverseDesign::residual(const UnloadedShape& at) const {
  const HermiteMesh unloaded = with_reference(imaged_.mesh(), at.reference_mm);
  const MaterialAxesField axes = carried_back(imaged_.mesh(), imaged_.material_axes());
  const size_t elements = unloaded.element_count();
  SystemResidual total;
  total.values.assign(imaged_.equations().unknowns(), 0.0);
  for (size_t n = 0; n < area_.size(); ++n)
    total.values[n] = -at.imaged.pressure_kPa * area_[n];
  std::vector<ElementResidual> locals(elements);
  parallel_for(elements, machine_threads(), [&](size_t e) {
    locals[e] = element_residual(make_reference_element(unloaded, e, axes),
                                 imaged_.element_state(at.imaged, e), imaged_.law(), imaged_.parameters(e));
  });
  for (size_t e = 0; e < elements; ++e) {
    imaged_.equations().add_force(e, locals[e].force, total.values);
    for (size_t m = 0; m < corners; ++m)
      total.values[imaged_.equations().displacement_unknowns() + imaged_.pressures().unknown[e][m]] +=
          locals[e].volume_mm3[m];
    if (!std::isfinite(locals[e].energy)) total.beyond_law = e;
    if (locals[e].least.ratio > 0.0) continue;
    const MaterialPoint point{e, gauss_tables().xi[locals[e].least.point]};
    total.inverted =
        InvertedPlace{point, imaged_.mesh().value(imaged_.mesh().reference(), point), locals[e].least.ratio};
  }
  return total;
}

bool InverseDesign::factorise(const UnloadedShape& at) {
  const HermiteMesh unloaded = with_reference(imaged_.mesh(), at.reference_mm);
  const size_t elements = unloaded.element_count();
  std::vector<std::vector<double>> parts(elements);
  parallel_for(elements, machine_threads(), [&](size_t e) {
    thread_local ReferenceTangent local;
    reference_tangent(imaged_.mesh(), e, unloaded.gather(e, at.reference_mm), imaged_.material_axes(),
                      imaged_.element_state(at.imaged, e), imaged_.law(), imaged_.parameters(e), local);
    thread_local ElementTangent by_pressure;
    element_tangent(
        make_reference_element(unloaded, e, carried_back(imaged_.mesh(), imaged_.material_axes())),
        imaged_.element_state(at.imaged, e), imaged_.law(), imaged_.parameters(e), by_pressure);
    const auto numbers = equations_of(imaged_, e);
    for (size_t column = 0; column < element_unknowns; ++column) {
      for (size_t row = 0; row < element_unknowns; ++row) {
        if (numbers[row] == EquationSystem::none || numbers[column] == EquationSystem::none) continue;
        const auto r = static_cast<Eigen::Index>(row), c = static_cast<Eigen::Index>(column);
        constexpr auto pressures = static_cast<Eigen::Index>(coefficients);
        double value = 0.0;
        if (row < coefficients && column < coefficients)
          value = local.force(r, c);
        else if (column < coefficients)
          value = local.volume(r - pressures, c);
        else if (row < coefficients)
          value = by_pressure.coupling[column - coefficients](r % 3, r / 3);
        else if (imaged_.compressibility_per_kPa() > 0.0)
          value = by_pressure.compliance(r - pressures, c - pressures);
        parts[e].push_back(value * scale_of(unloaded, e, row) * scale_of(unloaded, e, column));
      }
    }
  });
  std::vector<double> values;
  values.reserve(rows_.size());
  for (const std::vector<double>& part : parts)
    values.insert(values.end(), part.begin(), part.end());
  if (!factor_) factor_.emplace(imaged_.equations().unknowns(), rows_, columns_, MatrixKind::general);
  return !factor_->factorise(values).singular;
}

struct InverseDesign::Attempt {
  SolveReason reason = SolveReason::no_convergence;
  UnloadedShape shape;
  size_t iterations = 0;
  std::optional<InvertedPlace> folded = {};
  std::optional<size_t> beyond_law = {};
};

InverseDesign::Attempt InverseDesign::attempt(UnloadedShape guess, const SolveOptions& options) {
  constexpr double least_damping = 0.05;
  Attempt result{.shape = std::move(guess)};
  const EquationSystem& equations = imaged_.equations();
  const auto moved = [&](const std::vector<double>& step, double fraction) {
    UnloadedShape next = result.shape;
    add_scaled(next.reference_mm, fraction, imaged_.node_field(step));
    for (size_t i = 0; i < next.imaged.lagrange_pressure_kPa.size(); ++i)
      next.imaged.lagrange_pressure_kPa[i] += fraction * step[equations.displacement_unknowns() + i];
    return next;
  };
  const auto size = [&](const std::vector<double>& step) {
    double sum = 0.0;
    for (size_t n = 0; n < equations.displacement_unknowns(); ++n)
      sum += step[n] * step[n];
    return std::sqrt(sum / static_cast<double>(equations.displacement_unknowns())) /
           imaged_.mesh().extent_mm();
  };
  SystemResidual residual = this->residual(result.shape);
  double last_size = std::numeric_limits<double>::infinity();
  while (result.iterations < options.newton_limit) {
    result.folded = residual.inverted;
    result.beyond_law = residual.beyond_law;
    if (residual.inverted || residual.beyond_law) break;
    ++result.iterations;
    if (!factorise(result.shape)) {
      result.reason = SolveReason::singular_tangent;
      return result;
    }
    std::vector<double> step = std::move(residual.values);
    for (double& value : step)
      value = -value;
    factor_->solve(step);
    const double step_size = size(step);
    if (!std::isfinite(step_size) || step_size > 2.0 * last_size) break;
    last_size = step_size;
    double damping = 1.0;
    UnloadedShape next = moved(step, damping);
    residual = this->residual(next);
    while ((residual.inverted || residual.beyond_law) && damping > least_damping) {
      damping *= 0.5;
      next = moved(step, damping);
      residual = this->residual(next);
    }
    if (residual.inverted || residual.beyond_law) continue;  // ends, and says so
    result.shape = std::move(next);
    if (options.on_iteration)
      options.on_iteration(result.shape.imaged.pressure_kPa, {.step = step_size, .damping = damping});
    if (damping == 1.0 && step_size <= options.tolerance) {
      result.reason = SolveReason::converged;
      return result;
    }
  }
  if (result.folded) result.reason = SolveReason::inverted_element;
  if (result.beyond_law) result.reason = SolveReason::beyond_law;
  return result;
}

UnloadedShape InverseDesign::solve(double pressure_kPa, const UnloadedShape* start,
                                   const SolveOptions& options) {
  UnloadedShape last;
  if (start != nullptr) {
    last = *start;
  } else {
    last.reference_mm = imaged_.mesh().reference();
    last.imaged = imaged_.rest_state();
  }
  UnloadReport report;
  const double from_kPa = last.imaged.pressure_kPa;
  constexpr double least_fraction = 1.0 / 64.0;  // of the pressure: what stalls there stalls for good
  double reached = 0.0, fraction = 1.0;
  for (size_t tried = 0; true; ++tried) {
    if (tried == options.load_step_limit) {
      report.reason = SolveReason::out_of_steps;
      break;
    }
    const double next = std::min(1.0, reached + fraction);
    UnloadedShape guess = last;
    guess.imaged.pressure_kPa = std::lerp(from_kPa, pressure_kPa, next);
    Attempt attempted = attempt(std::move(guess), options);
    report.iterations += attempted.iterations;
    if (attempted.reason == SolveReason::converged) {
      if (const auto fold =
              fold_of(with_reference(imaged_.mesh(), attempted.shape.reference_mm), imaged_.mesh())) {
        attempted.reason = SolveReason::inverted_element;
        attempted.folded = fold;
      }
    }
    if (attempted.reason == SolveReason::converged) {
      last = std::move(attempted.shape);
      reached = next;
      ++report.load_steps;
      if (reached == 1.0) break;
      continue;
    }
    fraction *= 0.5;
    if (pressure_kPa == from_kPa || fraction < least_fraction) {
      report.reason = attempted.reason;
      report.folded = attempted.folded;
      report.beyond_law = attempted.beyond_law;
      break;
    }
  }
  report.reached_pressure_kPa = last.imaged.pressure_kPa;
  last.report = std::move(report);
  return last;
}

InverseDesign::Derivatives InverseDesign::derivatives(const UnloadedShape& at,
                                                      std::span<const ParameterGroup> groups) {
  const size_t unknowns = imaged_.equations().unknowns();
  std::vector<double> right_sides((groups.size() + 1) * unknowns, 0.0);
  std::copy(area_.begin(), area_.end(), right_sides.begin());
  const ElasticModel model = on_unloaded(imaged_, at.reference_mm);
  for (size_t g = 0; g < groups.size(); ++g) {
    const std::span<double> column = std::span(right_sides).subspan((g + 1) * unknowns, unknowns);
    model.system().add_parameter_residual(at.imaged, groups[g].parameter, groups[g].elements, column);
    for (double& value : column)
      value = -value;
  }
  if (!factorise(at)) throw std::domain_error("the shape without load is singular: it has no derivatives");
  factor_->solve(right_sides, groups.size() + 1);
  Derivatives result;
  result.by_pressure = imaged_.node_field(std::span(right_sides).first(unknowns));
  for (size_t g = 0; g < groups.size(); ++g)
    result.by_parameter.push_back(
        imaged_.node_field(std::span(right_sides).subspan((g + 1) * unknowns, unknowns)));
  return result;
}

void InverseDesign::add_reference_residual(const NodeField& reference_mm, const ElasticState& state,
                                           std::span<const NodeField> changes,
                                           std::span<double> target) const {
  const HermiteMesh unloaded = with_reference(imaged_.mesh(), reference_mm);
  const size_t unknowns = imaged_.equations().unknowns();
  for (size_t e = 0; e < unloaded.element_count(); ++e) {
    thread_local ReferenceTangent local;
    reference_tangent(imaged_.mesh(), e, unloaded.gather(e, reference_mm), imaged_.material_axes(),
                      imaged_.element_state(state, e), imaged_.law(), imaged_.parameters(e), local);
    for (size_t i = 0; i < changes.size(); ++i) {
      const ElementField change = unloaded.gather(e, changes[i]);
      const Eigen::Map<const Eigen::Vector<double, coefficients>> by(change.data());
      const std::span<double> column = target.subspan(i * unknowns, unknowns);
      imaged_.equations().add_force(e, over_functions(local.force * by), column);
      const Eigen::Vector<double, corners> volume = local.volume * by;
      for (size_t m = 0; m < corners; ++m)
        column[imaged_.equations().displacement_unknowns() + imaged_.pressures().unknown[e][m]] +=
            volume[static_cast<Eigen::Index>(m)];
    }
  }
}

ElasticModel alike(const ElasticSystem& system, HermiteMesh mesh, MaterialAxesField axes,
                   SolveOptions solve) {
  ElasticOptions options;
  const std::span<const double> first = system.parameters(0);
  options.parameters.assign(first.begin(), first.end());
  options.held = system.held();
  options.material_axes = std::move(axes);
  options.volume_stiffness_kPa = system.volume_stiffness_kPa();
  if (system.compressibility_per_kPa() > 0.0)
    options.bulk_modulus_kPa = 1.0 / system.compressibility_per_kPa();
  options.solve = std::move(solve);
  ElasticModel model(std::move(mesh), system.law(), options);
  for (size_t e = 0; e < system.mesh().element_count(); ++e)
    for (size_t i = 0; i < first.size(); ++i)
      model.set_element_parameter(i, e, system.parameters(e)[i]);
  return model;
}

ElasticModel on_unloaded(const ElasticSystem& imaged, NodeField reference_mm, SolveOptions solve) {
  return alike(imaged, with_reference(imaged.mesh(), std::move(reference_mm)),
               carried_back(imaged.mesh(), imaged.material_axes()), std::move(solve));
}

bool UnloadReturn::returned(const HermiteMesh& imaged) const {
  constexpr double allowed = 1e-4;  // of the extent
  return report.converged() && report.stable() != false && farthest_mm < allowed * imaged.extent_mm();
}

UnloadReturn inflate_again(ElasticModel& unloaded, const HermiteMesh& imaged, double pressure_kPa) {
  const Solution solution = unloaded.solve(pressure_kPa);
  UnloadReturn result{solution.report};
  for (size_t e = 0; e < imaged.element_count(); ++e) {
    for (size_t sample = 0; sample < 27; ++sample) {
      const MaterialPoint point{
          e,
          {0.5 * static_cast<double>(sample % 3), 0.5 * static_cast<double>(sample / 3 % 3),
           0.5 * static_cast<double>(sample / 9)}};
      const Eigen::Vector3d miss_mm =
          imaged.value(solution.state.position_mm, point) - imaged.value(imaged.reference(), point);
      result.farthest_mm = std::max(result.farthest_mm, miss_mm.norm());
    }
  }
  return result;
}

}  // namespace diastole
