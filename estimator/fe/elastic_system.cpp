#include "estimator/fe/elastic_system.hpp"

#include <algorithm>
#include <utility>

#include "estimator/fe/parallel_for.hpp"

namespace diastole {

ElasticSystem::ElasticSystem(HermiteMesh mesh, const Law& law, const SystemOptions& options)
    : mesh_(std::move(mesh)),
      law_(&law),
      count_(law.parameters().size()),
      pressures_(make_pressure_map(mesh_, options.pressure_space)),
      equations_(mesh_, options.held, pressures_),
      loaded_(options.loaded),
      material_axes_(options.material_axes),
      volume_stiffness_kPa_(options.volume_stiffness_kPa),
      threads_(options.threads),
      factor_(equations_.unknowns(), equations_.rows(), equations_.columns()) {
  for (size_t e = 0; e < mesh_.element_count(); ++e) {
    parameters_.insert(parameters_.end(), options.parameters.begin(), options.parameters.end());
    reference_.push_back(make_reference_element(mesh_, e, options.material_axes));
  }
}

ElementState ElasticSystem::element_state(const ElasticState& state, size_t element) const {
  ElementState local;
  local.position_mm = mesh_.gather(element, state.position_mm);
  local.fibre_tension_kPa = state.fibre_tension_kPa;
  local.volume_stiffness_kPa = volume_stiffness_kPa_;
  for (size_t m = 0; m < corners; ++m) {
    local.pressure_kPa[m] = state.lagrange_pressure_kPa[pressures_.unknown[element][m]];
  }
  return local;
}

ElasticState ElasticSystem::rest_state() const {
  ElasticState state;
  state.position_mm = mesh_.reference();
  state.lagrange_pressure_kPa.assign(pressures_.count, 0.0);
  std::vector<double> sharers(pressures_.count, 0.0);
  constexpr SymmetricTensor<double> undeformed{1.0, 1.0, 1.0, 0.0, 0.0, 0.0};
  for (size_t e = 0; e < mesh_.element_count(); ++e) {
    const double mean_stress = trace(law_->stress(undeformed, parameters(e))) / 3.0;
    for (const size_t unknown : pressures_.unknown[e]) {
      state.lagrange_pressure_kPa[unknown] += mean_stress;
      sharers[unknown] += 1.0;
    }
  }
  for (size_t i = 0; i < pressures_.count; ++i)
    state.lagrange_pressure_kPa[i] /= sharers[i];
  return state;
}

double ElasticSystem::cavity_volume_mm3(const ElasticState& state) const {
  double volume = 0.0;
  for (const ElementFace& face : mesh_.faces().inner) {
    volume += face_volume_mm3(face, mesh_.gather(face.element, state.position_mm));
  }
  return volume;
}

std::vector<double> ElasticSystem::cavity_area(const ElasticState& state) const {
  std::vector<double> area(equations_.unknowns(), 0.0);
  for (const ElementFace& face : loaded_) {
    const FaceField on_face = face_area_mm2(face, mesh_.gather(face.element, state.position_mm));
    const std::array<size_t, face_functions> functions = face_hermite_functions(face);
    ElementField force = ElementField::Zero();
    for (size_t a = 0; a < face_functions; ++a) {
      force.col(static_cast<Eigen::Index>(functions[a])) = on_face.col(static_cast<Eigen::Index>(a));
    }
    equations_.add_force(face.element, force, area);
  }
  return area;
}

SystemResidual ElasticSystem::residual(const ElasticState& state) const {
  SystemResidual total;
  total.values = cavity_area(state);
  for (double& value : total.values)
    value *= -state.pressure_kPa;
  const std::span<double> pressure_rows = std::span(total.values).subspan(equations_.displacement_unknowns());
  std::vector<double> energies(mesh_.element_count());
  std::vector<LeastVolumeRatio> least(mesh_.element_count());
  for (const std::vector<size_t>& colour : equations_.colours()) {
    parallel_for(colour.size(), threads_, [&](size_t i) {
      const size_t e = colour[i];
      const ElementResidual local =
          element_residual(reference_[e], element_state(state, e), *law_, parameters(e));
      equations_.add_force(e, local.force, total.values);
      for (size_t m = 0; m < corners; ++m)
        pressure_rows[pressures_.unknown[e][m]] += local.volume_mm3[m];
      energies[e] = local.energy;
      least[e] = local.least;
    });
  }
  for (const double energy : energies)
    total.energy_uJ += energy;
  const auto worst = std::min_element(least.begin(), least.end(),
                                      [](const auto& a, const auto& b) { return a.ratio < b.ratio; });
  if (worst->ratio <= 0.0) {
    const MaterialPoint point{static_cast<size_t>(worst - least.begin()), gauss_tables().xi[worst->point]};
    total.inverted = InvertedPlace{point, mesh_.value(mesh_.reference(), point), worst->ratio};
  }
  return total;
}

std::vector<double> ElasticSystem::tangent(const ElasticState& state) const {
  std::vector<double> values(equations_.rows().size(), 0.0);
  for (const std::vector<size_t>& colour : equations_.colours()) {
    parallel_for(colour.size(), threads_, [&](size_t i) {
      thread_local ElementTangent local;
      const size_t e = colour[i];
      element_tangent(reference_[e], element_state(state, e), *law_, parameters(e), local);
      equations_.add_tangent(e, local, values);
    });
  }
  for (const ElementFace& face : loaded_) {
    const FaceTangent on_face = face_tangent_mm(face, mesh_.gather(face.element, state.position_mm));
    equations_.add_face_tangent(face.element, face_hermite_functions(face), on_face, -state.pressure_kPa,
                                values);
  }
  return values;
}

void ElasticSystem::add_parameter_residual(const ElasticState& state, size_t parameter,
                                           std::span<const size_t> elements, std::span<double> target) const {
  const auto add = [&](size_t e) {
    equations_.add_force(
        e, element_parameter_force(reference_[e], element_state(state, e), *law_, parameters(e), parameter),
        target);
  };
  for (const size_t e : elements)
    add(e);
  if (elements.empty()) {
    for (size_t e = 0; e < mesh_.element_count(); ++e)
      add(e);
  }
}

FactorResult ElasticSystem::factorise(const ElasticState& state) {
  std::vector<double> values = tangent(state);
  return factor_.factorise(values);
}

ElasticState ElasticSystem::moved(const ElasticState& state, std::span<const double> step,
                                  double fraction) const {
  ElasticState next = state;
  for (size_t dof = 0; dof < next.position_mm.size(); ++dof) {
    const size_t equation = equations_.equation(dof);
    if (equation != EquationSystem::none) next.position_mm[dof] += fraction * step[equation];
  }
  for (size_t i = 0; i < pressures_.count; ++i) {
    next.lagrange_pressure_kPa[i] += fraction * step[equations_.displacement_unknowns() + i];
  }
  return next;
}

NodeField ElasticSystem::node_field(std::span<const double> unknowns) const {
  NodeField field(mesh_.node_count() * dofs_per_node, 0.0);
  for (size_t dof = 0; dof < field.size(); ++dof) {
    const size_t equation = equations_.equation(dof);
    if (equation != EquationSystem::none) field[dof] = unknowns[equation];
  }
  return field;
}

}  // namespace diastole
