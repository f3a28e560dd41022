#pragma once
// Phase contrast of a flow phantom: two images of each phase of the cycle, one of which encodes velocity; the difference of their phases and the mean of
// their magnitudes, as DICOM. Nothing of this knows how flow is measured.

#include <Eigen/Dense>
#include <filesystem>
#include <optional>

#include "tools/sim_scanner/dicom_image.hpp"
#include "tools/sim_scanner/flow_phantom.hpp"

namespace diastole::scanner {

struct PhaseContrastProtocol {
  int matrix = 96;
  double pixel_mm = 0.625;
  int phases = 16;
  double venc_cm_s = 100;
  Maker maker = Maker::siemens;
  bool says_venc = true;
  bool is_balanced = false;  ///< either image encodes half
  double snr = 25;           ///< of still gel, in one channel of one image
  double acquired = 1.0;     ///< share of the spectrum's lines each way that is measured; the rest is zero
  double inflow = 0.2;       ///< by how much fluid at the venc outshines fluid at rest
  double fluid_brightness = 1.4;  ///< beside still gel's
  double wall_brightness = 0;     ///< likewise
  double shading = 0.1;
  Eigen::Vector2d place_mm = {
      1.3, -2.1};        ///< of the tube's axis from the image's middle, along a row and along a column
  double tilt_deg = 0;   ///< of the tube against the slice's normal, about the columns: an ellipse is cut
  double wobble_mm = 0;  ///< by which the tube shakes along a row with the flow
  Eigen::Vector3d background_cm_s = {
      0.8, 2.0, -1.5};  ///< in the middle, its change over 50 mm along rows, and along columns
  Eigen::Vector3d along_row = {1, 0, 0}, along_column = {0, 1, 0};
  Eigen::Vector3d middle_mm = {0, 0, 0};  ///< of the image, patient coordinates
  int first_series = 4;                   ///< number of the magnitudes' series; the velocities' is the next
  std::optional<int> missing_phase = {};  ///< from 1
  bool has_magnitude = true;
  unsigned seed = 1;

  [[nodiscard]] double time_s(int phase, double period_s) const { return period_s * (phase + 0.5) / phases; }
};

/// Writes mNN.dcm and vNN.dcm into the folder, which must exist.
void scan_flow(const FlowPhantom& phantom, const PhaseContrastProtocol& protocol,
               const std::filesystem::path& folder);

}  // namespace diastole::scanner
