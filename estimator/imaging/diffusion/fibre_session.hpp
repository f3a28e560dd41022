#pragma once
// From a folder with a diffusion series to tensors and, on a ventricle's mesh, to its fibre field.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "estimator/imaging/diffusion/axis_check.hpp"
#include "estimator/imaging/diffusion/fibre_estimate.hpp"
#include "estimator/imaging/diffusion/signal_outliers.hpp"
#include "estimator/io/fibre_points.hpp"
#include "estimator/io/fibres_file.hpp"

namespace diastole::imaging {

struct FibreSessionRequest {
  std::filesystem::path folder;
  DiffusionRequest series = {};
  bool keep_outliers = false;
  std::optional<AxisCandidate> axes = {};  ///< absent: checked, and corrected where the wall contradicts them
  /// S = S0 exp(-2 b gᵀDg), the paper's Eq. 3: D is half of what it is otherwise. Directions do not depend on it.
  bool factor_two = false;
  std::optional<std::filesystem::path> at =
      {};  ///< places at which the field is wanted; absent: over all of the mesh
};

struct FibreSession {
  std::string folder;
  DiffusionSeries series;  ///< without its outliers
  std::vector<SignalOutlier> outliers = {};
  TensorImage tensors = {};  ///< with directions corrected
  /// Medians over the wall or, without a mesh, over all voxels that are brighter than noise.
  double snr = 0, md = 0, fa = 0;
  double fa_of_noise = 0;  ///< what noise alone makes of an isotropic material
  std::optional<AxisCheck> axes = {};
  std::optional<FibreEstimate> field = {};
  std::vector<FibrePointRow> rows = {};
  double sigma_deg = 0;  ///< median of the rows'
  std::vector<Finding> findings = {};
};

/// `wall` in patient coordinates; without it there are only tensors. Throws InputError for what `diastole fibres --help` lists as refused.
FibreSession measure_fibres(const FibreSessionRequest& request, const std::optional<HermiteMesh>& wall,
                            const std::function<void(const std::string&)>& stage = {});

inline constexpr std::string_view tensor_file_mark = "x_mm,y_mm,z_mm,Dxx,Dxy,Dxz,Dyy,Dyz,Dzz";
std::string tensor_file_text(const TensorImage& tensors);

FibresRecord fibres_record(const FibreSession& session);

}  // namespace diastole::imaging
