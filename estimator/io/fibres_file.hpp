#pragma once
// Measured fibres as `diastole fibres --page` shows them and `diastole report` reads them again (JSON, format "diastole-fibres").

#include <string>
#include <string_view>
#include <vector>

#include "estimator/io/finding.hpp"

namespace diastole {

inline constexpr std::string_view fibres_record_mark = "diastole-fibres";

/// One slice's picture: the angle of each voxel's fibre to the image plane.
struct FibreSliceRecord {
  std::string
      angle;  ///< 8 bits a pixel, row by row, base64; 0 is across the plane or no tissue, 255 in the plane
};

/// One layer of the wall, seen from the side: strokes along the fibres of its near half.
struct FibreLayerRecord {
  std::string name;                      ///< "endocardium"
  std::vector<double> x_mm, y_mm;        ///< middles of the strokes, y towards the base
  std::vector<double> along_x, along_y;  ///< the direction's parts in the picture
  std::vector<double> helix_deg;
};

struct FibresRecord {
  std::string folder, series;
  std::vector<double> b_values;
  size_t directions = 0, volumes = 0, slices = 0;
  double snr = 0;                          ///< of the unweighted signal, in the middle
  double md = 0, fa = 0, fa_of_noise = 0;  ///< medians; md in 1e-3 mm²/s
  size_t outliers = 0;
  std::string axes;  ///< what was done to the directions; empty without a mesh
  double axes_agreement = 0, axes_agreement_as_said = 0;
  // The field, if there is a mesh.
  size_t wall_voxels = 0;
  double rms_deg = 0, sigma_deg = 0;
  std::vector<double> depth, helix_deg, helix_low_deg,
      helix_high_deg;  ///< its course through the wall: median, and 10 to 90 % of places
  std::vector<FibreLayerRecord> layers;
  int rows = 0, columns = 0;
  double pixel_aspect = 1;  ///< height over width
  std::vector<FibreSliceRecord> pictures;
  std::vector<Finding> findings;
};

std::string to_json(const FibresRecord& record);
bool is_fibres(std::string_view text);
/// Throws InputError (file, problem, remedy) unless it is a whole one.
FibresRecord fibres_record_from_json(std::string_view text, const std::string& file);

}  // namespace diastole
