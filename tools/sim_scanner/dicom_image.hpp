#pragma once
// An image as a scanner exports it: classic MR, one file an image.

#include <Eigen/Dense>
#include <filesystem>
#include <optional>
#include <string>

#include "tools/sim_scanner/slice_image.hpp"

namespace diastole::scanner {

/// How a maker stores velocities: parts of the full scale with the venc in the sequence's name, cm/s from the lower end on, or signed steps of 0.1 cm/s.
enum class Maker { siemens, philips, ge };

struct VelocityLabel {
  Maker maker = Maker::siemens;
  double venc_cm_s = 0;
  bool says_venc = true;
  bool is_velocity = false;  ///< else the magnitude that belongs to it
};

struct DiffusionLabel {
  double b_s_mm2 = 0;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< patient coordinates; none without weighting
};

struct ImageLabel {
  std::string study_uid, series_uid, image_uid;
  int series_number;
  int instance;
  double trigger_ms;
  double interval_ms;                                 ///< the cycle
  Eigen::Vector3d first_mm, along_row, along_column;  ///< patient coordinates
  double pixel_mm;
  double thickness_mm;
  std::optional<VelocityLabel> velocity = {};
  std::optional<DiffusionLabel> diffusion = {};  ///< such an image has no time in the cycle
};

/// Tissue of brightness 1 is written as 1000; a velocity picture holds half turns, -1 to 1. No name, no identity. Throws InputError if the file cannot be written.
void write_dicom(const std::filesystem::path& file, const Picture& picture, const ImageLabel& label);

}  // namespace diastole::scanner
