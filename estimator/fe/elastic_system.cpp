#include "estimator/fe/elastic_system.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/parallel/parallel_for.hpp"

namespace diastole {

namespace {

constexpr double mm3_per_mL = 1e3;

HeldDofs held_by(const ElasticOptions& options, const HermiteMesh& mesh) {
  if (options.held) return *options.held;
  HeldDofs held = hold_nothing(mesh);
  if (!options.bonded.empty()) return held;
  hold_face(mesh, mesh.faces().bottom, held);
  hold_face(mesh, mesh.faces().top, held);
  return held;
}

const std::vector<ElementFace>& loaded_by(const ElasticOptions& options, const HermiteMesh& mesh) {
  return options.loaded ? *options.loaded : mesh.faces().inner;
}

EquationOptions equation_options(const ElasticOptions& options, const HermiteMesh& mesh) {
  EquationOptions equations;
  equations.compressible = options.bulk_modulus_kPa.has_value();
  if (options.chamber && options.chamber->sealed()) equations.fluids.push_back(mesh.faces().outer);
  equations.fluids.push_back(loaded_by(options, mesh));
  return equations;
}

std::vector<ElementFace> plates_of(const ElasticOptions& options) {
  std::vector<ElementFace> plates;
  for (const BondedFaces& bonded : options.bonded)
    plates.insert(plates.end(), bonded.faces.begin(), bonded.faces.end());
  return plates;
}

/// Area vectors of a face's functions, as a field over its element.
ElementField over_element(const ElementFace& face, const FaceField& on_face) {
  ElementField field = ElementField::Zero();
  field(Eigen::all, face_hermite_functions(face)) = on_face;
  return field;
}

}  // namespace

ElasticSystem::ElasticSystem(HermiteMesh mesh, const Law& law, const ElasticOptions& options)
    : mesh_(std::move(mesh)),
      law_(&law),
      count_(law.parameters().size()),
      pressures_(make_pressure_map(mesh_, options.pressure_space)),
      held_(held_by(options, mesh_)),
      cavity_(mesh_, loaded_by(options, mesh_), held_, plates_of(options)),
      chamber_(options.chamber),
      material_axes_(options.material_axes),
      stiffness_(options.stiffness),
      volume_stiffness_kPa_(options.volume_stiffness_kPa),
      compressibility_per_kPa_(options.bulk_modulus_kPa ? 1.0 / *options.bulk_modulus_kPa : 0.0),
      threads_(options.threads > 0 ? options.threads : machine_threads()),
      equations_(
          std::make_shared<const EquationSystem>(mesh_, held_, pressures_, equation_options(options, mesh_))),
      skew_(std::make_shared<const RimSkew>(*equations_, cavity_.free_rim())),
      factor_(equations_, skew_) {
  for (size_t e = 0; e < mesh_.element_count(); ++e) {
    parameters_.insert(parameters_.end(), options.parameters.begin(), options.parameters.end());
    reference_.push_back(make_reference_element(mesh_, e, options.material_axes, options.stiffness));
  }
  if (chamber_) {
    chamber_wall_ = FluidSurface(mesh_, mesh_.faces().outer, held_, plates_of(options));
    undeformed_chamber_mm3_ = chamber_wall_.volume_mm3(mesh_, mesh_.reference());
  }
  for (const BondedFaces& bonded : options.bonded) {
    for (const ElementFace& face : bonded.faces)
      springs_.push_back({face, bond_stiffness(mesh_, face, bonded.bond)});
  }
}

void ElasticSystem::set_stiffness(size_t element, const std::array<double, gauss_points>& stiffness) {
  for (size_t q = 0; q < gauss_points; ++q)
    reference_[element][q].stiffness = stiffness[q];
}

ElementState ElasticSystem::element_state(const ElasticState& state, size_t element) const {
  ElementState local;
  local.position_mm = mesh_.gather(element, state.position_mm);
  local.fibre_tension_kPa = state.fibre_tension_kPa;
  local.volume_stiffness_kPa = volume_stiffness_kPa_;
  local.compressibility_per_kPa = compressibility_per_kPa_;
  const bool is_even = std::ranges::all_of(
      reference_[element], [](const ReferencePoint& point) { return point.stiffness == 1.0; });
  local.rest_pressure_kPa = compressibility_per_kPa_ > 0.0 || !is_even ? rest_pressure_kPa(element) : 0.0;
  for (size_t m = 0; m < corners; ++m) {
    local.pressure_kPa[m] = state.lagrange_pressure_kPa[pressures_.unknown[element][m]];
  }
  return local;
}

bool ElasticSystem::on_springs(const ElementFace& face) const {
  return std::any_of(springs_.begin(), springs_.end(), [&](const SpringFace& spring) {
    return spring.face.element == face.element && spring.face.direction == face.direction &&
           spring.face.side == face.side;
  });
}

double ElasticSystem::rest_pressure_kPa(size_t element) const {
  return law_->rest_pressure_kPa(parameters(element));
}

ElasticState ElasticSystem::rest_state() const {
  ElasticState state;
  state.position_mm = mesh_.reference();
  state.lagrange_pressure_kPa.assign(pressures_.count, 0.0);
  std::vector<double> element_counts(pressures_.count, 0.0);
  for (size_t e = 0; e < mesh_.element_count(); ++e) {
    const double mean_stress = rest_pressure_kPa(e);
    for (const size_t unknown : pressures_.unknown[e]) {
      state.lagrange_pressure_kPa[unknown] += mean_stress;
      element_counts[unknown] += 1.0;
    }
  }
  for (size_t i = 0; i < pressures_.count; ++i)
    state.lagrange_pressure_kPa[i] /= element_counts[i];
  return state;
}

double ElasticSystem::cavity_volume_mm3(const ElasticState& state) const {
  return cavity_.closed() ? cavity_.volume_mm3(mesh_, state.position_mm) : 0.0;
}

double ElasticSystem::chamber_intake_mm3(const ElasticState& state) const {
  return chamber_ ? undeformed_chamber_mm3_ - chamber_wall_.volume_mm3(mesh_, state.position_mm) : 0.0;
}

void ElasticSystem::add_area(const FluidSurface& surface, const NodeField& position_mm, double factor,
                             std::span<double> target) const {
  for (const FluidFace& face : surface.faces()) {
    const size_t element = face.face.element;
    const FaceField on_face = face.area_mm2(mesh_.gather(element, position_mm));
    equations_->add_force(element, over_element(face.face, factor * on_face), target);
  }
}

std::vector<double> ElasticSystem::cavity_area(const ElasticState& state) const {
  std::vector<double> area(equations_->unknowns(state.held_volume_mm3.has_value()), 0.0);
  add_area(cavity_, state.position_mm, 1.0, area);
  return area;
}

SystemResidual ElasticSystem::residual(const ElasticState& state) const {
  SystemResidual total;
  total.values.assign(equations_->unknowns(state.held_volume_mm3.has_value()), 0.0);
  add_fluids(state, total.values);
  add_springs(state, total);
  const std::span<double> pressure_rows =
      std::span(total.values).subspan(equations_->displacement_unknowns());
  std::vector<double> energies(mesh_.element_count());
  std::vector<LeastVolumeRatio> least(mesh_.element_count());
  for (const std::vector<size_t>& colour : equations_->colours()) {
    parallel_for(colour.size(), threads_, [&](size_t i) {
      const size_t e = colour[i];
      const ElementResidual local =
          element_residual(reference_[e], element_state(state, e), *law_, parameters(e));
      equations_->add_force(e, local.force, total.values);
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
  const auto no_stress =
      std::find_if_not(energies.begin(), energies.end(), [](double energy) { return std::isfinite(energy); });
  if (no_stress != energies.end()) total.beyond_law = static_cast<size_t>(no_stress - energies.begin());
  if (worst->ratio <= 0.0) {
    const MaterialPoint point{static_cast<size_t>(worst - least.begin()), gauss_tables().xi[worst->point]};
    total.inverted = InvertedPlace{point, mesh_.value(mesh_.reference(), point), worst->ratio};
  }
  return total;
}

void ElasticSystem::add_fluids(const ElasticState& state, std::span<double> residual) const {
  add_area(cavity_, state.position_mm, -state.pressure_kPa, residual);
  if (state.held_volume_mm3)
    residual[equations_->fluid_rows().back().unknown] = *state.held_volume_mm3 - cavity_volume_mm3(state);
  if (!chamber_) return;
  add_area(chamber_wall_, state.position_mm, -state.chamber_pressure_kPa, residual);
  if (chamber_->sealed()) {
    residual[equations_->fluid_rows().front().unknown] =
        chamber_intake_mm3(state) - mm3_per_mL * chamber_->compliance_mL_per_kPa *
                                        (state.chamber_pressure_kPa - state.sealing_pressure_kPa);
  }
}

void ElasticSystem::add_springs(const ElasticState& state, SystemResidual& total) const {
  for (const SpringFace& spring : springs_) {
    const size_t element = spring.face.element;
    const ElementField displacement =
        mesh_.gather(element, state.position_mm) - mesh_.gather(element, mesh_.reference());
    const FaceField on_face = displacement(Eigen::all, face_hermite_functions(spring.face));
    FaceField force_on_face;
    force_on_face.reshaped() = spring.stiffness * on_face.reshaped();
    const ElementField force = over_element(spring.face, force_on_face);
    equations_->add_force(element, force, total.values);
    total.bond_energy_uJ += 0.5 * force.cwiseProduct(displacement).sum();
  }
}

void ElasticSystem::add_fluid_rows(const ElasticState& state, std::span<double> values) const {
  const auto fill = [&](const FluidRow& row, const FluidSurface& surface, double compliance_mm3_per_kPa) {
    std::vector<double> area(equations_->displacement_unknowns(), 0.0);
    add_area(surface, state.position_mm, 1.0, area);
    for (size_t n = 0; n < row.columns.size(); ++n)
      values[row.entry + n] = -area[row.columns[n]];
    values[row.diagonal()] = -compliance_mm3_per_kPa;
  };
  if (chamber_ && chamber_->sealed())
    fill(equations_->fluid_rows().front(), chamber_wall_, mm3_per_mL * chamber_->compliance_mL_per_kPa);
  if (state.held_volume_mm3) fill(equations_->fluid_rows().back(), cavity_, 0.0);
}

std::vector<double> ElasticSystem::tangent(const ElasticState& state, double probing_stiffness_kPa) const {
  std::vector<double> values(equations_->entries(state.held_volume_mm3.has_value()), 0.0);
  for (const std::vector<size_t>& colour : equations_->colours()) {
    parallel_for(colour.size(), threads_, [&](size_t i) {
      thread_local ElementTangent local;
      const size_t e = colour[i];
      ElementState element = element_state(state, e);
      element.probing_stiffness_kPa = probing_stiffness_kPa;
      element_tangent(reference_[e], element, *law_, parameters(e), local);
      equations_->add_tangent(e, local, values);
      if (compressibility_per_kPa_ > 0.0) equations_->add_compliance(e, local.compliance, values);
    });
  }
  const auto add_faces = [&](const FluidSurface& surface, double pressure_kPa) {
    for (const FluidFace& face : surface.faces()) {
      const size_t element = face.face.element;
      equations_->add_face_tangent(element, face_hermite_functions(face.face),
                                   face.tangent_mm(mesh_.gather(element, state.position_mm)), -pressure_kPa,
                                   values);
    }
  };
  add_faces(cavity_, state.pressure_kPa);
  add_faces(chamber_wall_, state.chamber_pressure_kPa);
  for (const SpringFace& spring : springs_)
    equations_->add_face_tangent(spring.face.element, face_hermite_functions(spring.face), spring.stiffness,
                                 1.0, values);
  add_fluid_rows(state, values);
  return values;
}

std::vector<double> ElasticSystem::skew_tangent(const ElasticState& state) const {
  return skew_->values(mesh_, state.position_mm, -state.pressure_kPa);
}

ElasticSystem::NodalForces ElasticSystem::nodal_forces(const ElasticState& state) const {
  const NodeField none(mesh_.node_count() * dofs_per_node, 0.0);
  NodalForces forces{none, none, none};
  const auto add = [&](size_t element, const ElementField& force, NodeField& target) {
    for (size_t a = 0; a < hermite_functions; ++a) {
      const size_t node = mesh_.element(element)[hermite_corner(a)];
      for (size_t i = 0; i < 3; ++i) {
        target[dof_of(node, hermite_derivative(a), i)] +=
            mesh_.scale(element, a) * force(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(a));
      }
    }
  };
  const auto add_pressure = [&](const FluidSurface& surface, double pressure_kPa, NodeField& target) {
    for (const FluidFace& face : surface.faces()) {
      const FaceField area = face.area_mm2(mesh_.gather(face.face.element, state.position_mm));
      add(face.face.element, over_element(face.face, pressure_kPa * area), target);
    }
  };
  add_pressure(cavity_, state.pressure_kPa, forces.cavity);
  add_pressure(chamber_wall_, state.chamber_pressure_kPa, forces.chamber);
  for (size_t e = 0; e < mesh_.element_count(); ++e)
    add(e, element_residual(reference_[e], element_state(state, e), *law_, parameters(e)).force,
        forces.supports);
  for (size_t dof = 0; dof < none.size(); ++dof)
    forces.supports[dof] -= forces.cavity[dof] + forces.chamber[dof];
  return forces;
}

void ElasticSystem::add_parameter_residual(const ElasticState& state, size_t parameter,
                                           std::span<const size_t> elements, std::span<double> target) const {
  const auto add = [&](size_t e) {
    equations_->add_force(
        e, element_parameter_force(reference_[e], element_state(state, e), *law_, parameters(e), parameter),
        target);
    if (compressibility_per_kPa_ == 0.0) return;
    const double rest_rise = trace(law_->stress_sensitivity(undeformed, parameters(e), parameter)) / 3.0;
    const std::array<double, corners> volume_mm3 = pressure_volume_mm3(reference_[e]);
    for (size_t m = 0; m < corners; ++m) {
      target[equations_->displacement_unknowns() + pressures_.unknown[e][m]] +=
          compressibility_per_kPa_ * rest_rise * volume_mm3[m];
    }
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
  if (!skew_->empty()) return factor_.factorise_general(values, skew_tangent(state));
  return factor_.factorise_symmetric(values, state.held_volume_mm3.has_value());
}

FactorResult ElasticSystem::inertia(const ElasticState& state, double probing_stiffness_kPa) {
  std::vector<double> values = tangent(state, probing_stiffness_kPa);
  return factor_.factorise_symmetric(values, state.held_volume_mm3.has_value());
}

double ElasticSystem::material_stiffness_kPa() const {
  double most = 0.0;
  for (size_t e = 0; e < mesh_.element_count(); ++e) {
    const TangentTensor tangent = law_->response(undeformed, parameters(e)).tangent;
    most = std::max(most, std::abs(rest_pressure_kPa(e)) + tangent.diagonal().head<3>().maxCoeff());
  }
  return most;
}

Stability ElasticSystem::stability(const ElasticState& state) {
  const size_t needed = pressure_unknowns(state);
  const FactorResult exact = inertia(state, 0.0);
  Stability found{.negative_pivots = exact.negative_pivots};
  if (!skew_->empty()) return found;
  found.singular = exact.singular;
  if (found.singular) return found;
  found.unstable_motions = 0;
  if (found.negative_pivots > needed) {
    const FactorResult probed = inertia(state, material_stiffness_kPa());
    found.singular = probed.singular;
    found.unstable_motions.reset();
    if (!probed.singular)
      found.unstable_motions = probed.negative_pivots - std::min(probed.negative_pivots, needed);
  }
  return found;
}

ElasticState ElasticSystem::moved(const ElasticState& state, std::span<const double> step,
                                  double fraction) const {
  ElasticState next = state;
  for (size_t dof = 0; dof < next.position_mm.size(); ++dof) {
    const size_t equation = equations_->equation(dof);
    if (equation != EquationSystem::none) next.position_mm[dof] += fraction * step[equation];
  }
  for (size_t i = 0; i < pressures_.count; ++i) {
    next.lagrange_pressure_kPa[i] += fraction * step[equations_->displacement_unknowns() + i];
  }
  if (chamber_ && chamber_->sealed())
    next.chamber_pressure_kPa += fraction * step[equations_->fluid_rows().front().unknown];
  if (state.held_volume_mm3) next.pressure_kPa += fraction * step[equations_->fluid_rows().back().unknown];
  return next;
}

NodeField ElasticSystem::node_field(std::span<const double> unknowns) const {
  NodeField field(mesh_.node_count() * dofs_per_node, 0.0);
  for (size_t dof = 0; dof < field.size(); ++dof) {
    const size_t equation = equations_->equation(dof);
    if (equation != EquationSystem::none) field[dof] = unknowns[equation];
  }
  return field;
}

}  // namespace diastole
