#pragma once
// An image as a scanner exports it: classic MR, one file an image.

#include <Eigen/Dense>
#include <filesystem>
#include <string>

#include "tools/sim_scanner/slice_image.hpp"

namespace diastole::scanner {

struct ImageLabel {
  std::string study_uid, series_uid, image_uid;
  int series_number;
  int instance;
  double trigger_ms;
  double interval_ms;                                 ///< the cycle
  Eigen::Vector3d first_mm, along_row, along_column;  ///< patient coordinates
  double pixel_mm;
  double thickness_mm;
};

/// Tissue of brightness 1 is written as 1000. No name, no identity. Throws InputError if the file cannot be written.
void write_dicom(const std::filesystem::path& file, const Picture& picture, const ImageLabel& label);

}  // namespace diastole::scanner
