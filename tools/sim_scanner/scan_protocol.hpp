#pragma once
// What a scan is made with. Lengths in mm, times in s.

#include <Eigen/Dense>
#include <string>
#include <vector>

namespace diastole::scanner {

struct TagProtocol {
  double spacing_mm = 5.0;
  std::vector<double> weights = {1, 1};            ///< of the pulses: 1-1 or binomial
  double flip_deg = 90.0;                          ///< of all of them together
  std::vector<double> angles_deg = {45.0, -45.0};  ///< of the tags' normals from the image's rows
  bool grid = false;                               ///< all directions in one image
};

struct ScanProtocol {
  std::vector<double> short_axis_mm = {0.0};  ///< heights of slices across the specimen's z
  std::vector<double> long_axis_deg = {};     ///< slices along z, turned about it from x
  double middle_mm = 0.0;                     ///< height of their middles
  double field_of_view_mm = 125.0;
  int matrix = 128;
  double acquired =
      0.75;  ///< share of the phase-encoding lines (along columns) that is measured; the rest is zero
  double thickness_mm = 6.0;
  TagProtocol tags;
  bool tagged = true;      ///< the tagged series
  bool cine = false;       ///< one without tags besides: balanced, so that water is brighter than tissue
  bool dark_bath = false;  ///< what the specimen hangs in gives no signal, as perfluoropolyether
  double snr = 20.0;       ///< signal of tissue over the noise of one channel
  double T1_s = 0.8;
  double shading = 0.2;  ///< by how much the coils' sensitivity differs from side to side
  unsigned seed = 1;
};

/// One moment of the cycle.
struct ScanPhase {
  double time_s;  ///< since the tags were made
  double pressure_kPa;
};

/// An image's plane in the specimen's axes, pixel (0, 0) at `first_mm`.
struct ScanPlane {
  Eigen::Vector3d first_mm;
  Eigen::Vector3d along_row;
  Eigen::Vector3d along_column;
  std::string view;  ///< "SA", "LA030"

  [[nodiscard]] Eigen::Vector3d normal() const { return along_row.cross(along_column); }
};

/// The protocol's slices, short axis first.
std::vector<ScanPlane> planes_of(const ScanProtocol& protocol);

}  // namespace diastole::scanner
