#include "estimator/imaging/geometry/ventricle_session.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "estimator/imaging/geometry/wall_map.hpp"
#include "estimator/mesh/ellipsoid.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::imaging {
namespace {

constexpr const char* look_again =
    "Look at this phase's points: a wall's contour is missing there, or points of one wall are named as the "
    "other's.";

void measure_thickness(VentriclePhase& phase, const WallMap& map) {
  constexpr int around = 24, along = 8;
  phase.least_thickness_mm = std::numeric_limits<double>::infinity();
  for (int i = 0; i < around; ++i) {
    // The apex is thinner and has no direction around it: the mean is that of the sides.
    for (int j = 0; j < along; ++j) {
      const double thickness =
          map.thickness_mm(2 * std::numbers::pi * i / around, 0.3 + 0.7 * j / (along - 1));
      phase.mean_thickness_mm += thickness / (around * along);
      phase.least_thickness_mm = std::min(phase.least_thickness_mm, thickness);
      phase.most_thickness_mm = std::max(phase.most_thickness_mm, thickness);
    }
  }
}

HermiteMesh sound_mesh(const GuidePoints& guide, const VentricleFit& fit, const VentricleWalls& walls,
                       const VentricleMeshOptions& options, MeshMeasures& measures) {
  const std::string place = fmt::format("phase {}", walls.phase);
  try {
    HermiteMesh mesh = ventricle_mesh(fit.frame, walls, options);
    measures = measure_mesh(mesh);
    if (measures.least_jacobian > 0) return mesh;
    const Eigen::Vector3d at = mesh.value(mesh.reference(), measures.least_at);
    throw InputError({guide.file, place,
                      fmt::format("the walls cross: element {} is folded at ({:.1f}, {:.1f}, {:.1f}) mm",
                                  measures.least_at.element + 1, at.x(), at.y(), at.z()),
                      look_again});
  } catch (const std::domain_error& error) {
    throw InputError({guide.file, place, error.what(), look_again});
  }
}

size_t chosen_phase(const VentricleRequest& request, const GuidePoints& guide) {
  if (request.phase < 0) return 0;
  const auto found = std::find(guide.phases.begin(), guide.phases.end(), request.phase);
  if (found == guide.phases.end())
    throw InputError({guide.file, "--phase", fmt::format("has no phase {}", request.phase),
                      fmt::format("It has {}.", fmt::join(guide.phases, ", "))});
  return static_cast<size_t>(found - guide.phases.begin());
}

}  // namespace

size_t VentricleSession::largest() const {
  const auto by_volume = [](const VentriclePhase& a, const VentriclePhase& b) {
    return a.mesh.cavity_mL < b.mesh.cavity_mL;
  };
  return static_cast<size_t>(std::max_element(phases.begin(), phases.end(), by_volume) - phases.begin());
}

size_t VentricleSession::smallest() const {
  const auto by_volume = [](const VentriclePhase& a, const VentriclePhase& b) {
    return a.mesh.cavity_mL < b.mesh.cavity_mL;
  };
  return static_cast<size_t>(std::min_element(phases.begin(), phases.end(), by_volume) - phases.begin());
}

double VentricleSession::ejection_fraction() const {
  return 1 - phases[smallest()].mesh.cavity_mL / phases[largest()].mesh.cavity_mL;
}

double VentricleSession::ejection_sigma() const {
  const VentriclePhase& most = phases[largest()];
  const VentriclePhase& least = phases[smallest()];
  const double ratio = least.mesh.cavity_mL / most.mesh.cavity_mL;
  return ratio *
         std::hypot(least.cavity_sigma_mL / least.mesh.cavity_mL, most.cavity_sigma_mL / most.mesh.cavity_mL);
}

VentricleSession measure_ventricle(const VentricleRequest& request, const GuidePoints& guide,
                                   const std::function<void(const std::string&)>& on_stage) {
  const size_t chosen = chosen_phase(request, guide);
  if (on_stage)
    on_stage(fmt::format("{} points in {} slices, {} phases: fitting both walls", guide.points.size(),
                         guide.slices.size(), guide.phases.size()));
  VentricleFit fit = fit_ventricle(guide, request.fit);
  std::vector<VentriclePhase> phases;
  std::optional<HermiteMesh> kept;
  for (size_t p = 0; p < fit.phases.size(); ++p) {
    const VentricleWalls& walls = fit.phases[p];
    VentriclePhase phase;
    phase.phase = walls.phase;
    HermiteMesh mesh = sound_mesh(guide, fit, walls, request.mesh, phase.mesh);
    const WallMap map(fit.frame, walls);
    phase.cavity_sigma_mL = map.cavity_sigma_mL();
    measure_thickness(phase, map);
    phase.mesh_error_mm = mesh_error_mm(fit.frame, walls, mesh);
    phase.inner = surface_points(mesh, 0);
    phase.outer = surface_points(mesh, 1);
    phases.push_back(std::move(phase));
    if (p == chosen) kept = std::move(mesh);
  }
  std::optional<FibreField> fibres;
  if (request.fibre_deg)
    fibres = ellipsoid_fibres({.elements = request.mesh.elements}, request.fibre_deg->at(0),
                              request.fibre_deg->at(1));
  std::vector<double> sigmas = node_sigmas_mm(fit.frame, fit.phases[chosen], request.mesh);
  return {
      std::move(fit), std::move(phases), chosen, {std::move(*kept), std::move(fibres)}, std::move(sigmas)};
}

}  // namespace diastole::imaging
