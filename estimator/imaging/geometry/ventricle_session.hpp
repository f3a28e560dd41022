#pragma once
// Guide points to a ventricle's mesh and its measures in every phase: what `diastole lv` does.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "estimator/imaging/geometry/ventricle_fit.hpp"
#include "estimator/imaging/geometry/ventricle_mesh.hpp"

namespace diastole::imaging {

struct VentricleRequest {
  std::filesystem::path guide;
  int phase = -1;  ///< of the mesh, as the file numbers it; -1: the first
  VentricleOptions fit;
  VentricleMeshOptions mesh;
  /// At the endocardium and the epicardium: a fibre angle linear through the wall goes into the mesh.
  std::optional<std::array<double, 2>> fibre_deg;
};

struct VentriclePhase {
  int phase = 0;
  MeshMeasures mesh;
  double cavity_sigma_mL = 0;
  double mean_thickness_mm = 0, least_thickness_mm = 0, most_thickness_mm = 0;
  double mesh_error_mm = 0;
  std::vector<Eigen::Vector3d> inner, outer;  ///< points of the surfaces
};

struct VentricleSession {
  VentricleFit fit;
  std::vector<VentriclePhase> phases;
  size_t chosen = 0;  ///< the phase of the mesh, an index into both
  MeshBody body;
  std::vector<double> node_sigma_mm;

  [[nodiscard]] size_t largest() const;
  [[nodiscard]] size_t smallest() const;
  /// Of the largest cavity that is ejected, and its standard deviation.
  [[nodiscard]] double ejection_fraction() const;
  [[nodiscard]] double ejection_sigma() const;
};

/// Throws InputError where the points do not make a ventricle, or a phase's wall is folded. `on_stage` gets what is done.
VentricleSession measure_ventricle(const VentricleRequest& request, const GuidePoints& guide,
                                   const std::function<void(const std::string&)>& on_stage = {});

}  // namespace diastole::imaging
