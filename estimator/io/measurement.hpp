#pragma once
// What was measured on the specimen: each frame's load, tag points, and full 3-D points.
// Lengths in mm in the specimen's axes (the annulus axis is z, its mid-height z = 0), pressures in kPa, times
// in s.

#include <array>
#include <filesystem>
#include <vector>

#include "estimator/io/study.hpp"

namespace diastole {

/// `NAME.frames.csv`: frame,time_s,pressure_kPa,sigma_kPa. The vector's index is the frame's number.
struct Frame {
  double time_s;
  double pressure_kPa;
  double sigma_kPa;  ///< standard deviation of the measured pressure
};

/// `NAME.tags.csv`: frame,nx,ny,nz,plane_mm,x_mm,y_mm,z_mm,sigma_mm. The stripe is seen at x_mm in the
/// deformed frame; before deformation its material lay on the plane normal · X = plane_mm (Eq. 2 of the
/// paper).
///
/// Two more columns, own_mm,own_sigma_mm, stand in files of tracked images: what the image says at this very place, without its
/// neighbours and its past, is that the stripe lies own_mm farther along the normal, with an error of standard
/// deviation own_sigma_mm that is independent of all other rows'. Such a row is read as that place with that sigma.
struct TagPoint {
  int frame;
  std::array<double, 3> normal;  ///< unit vector
  double plane_mm;
  std::array<double, 3> x_mm;
  double sigma_mm;  ///< standard deviation of x_mm along `normal`
};

/// `NAME.points.csv`: frame,X_mm,Y_mm,Z_mm,x_mm,y_mm,z_mm,sigma_mm. Material at X_mm is seen at x_mm.
struct ObservedPoint {
  int frame;
  std::array<double, 3> X_mm;
  std::array<double, 3> x_mm;
  double sigma_mm;  ///< standard deviation of each component of x_mm
};

struct Measurement {
  std::vector<Frame> frames;
  std::vector<TagPoint> tags;
  std::vector<ObservedPoint> points;
  bool planes_as_seen =
      false;  ///< the tags' planes were found in images too (own columns), and are only as sure as those
  size_t repeated_rows =
      0;  ///< rows of the files that were left out here: the same as another, to the last digit
};

// Each throws InputError with file, line, column, value and remedy.

/// Frames must be 0, 1, 2, ... in order, times increasing, sigma >= 0, pressures within ±100 kPa.
std::vector<Frame> read_frames(const std::filesystem::path& path);
/// Every row's frame must exist; |normal| must be 1 to 1e-4 (it is then normalised); sigma > 0.
/// `planes_as_seen`: whether the file has own columns.
std::vector<TagPoint> read_tags(const std::filesystem::path& path, int frame_count,
                                bool* planes_as_seen = nullptr);
/// Every row's frame must exist; sigma > 0.
std::vector<ObservedPoint> read_points(const std::filesystem::path& path, int frame_count);

/// Everything that the study names, each row once, checked against the specimen's size (points in metres, or in the
/// scanner's axes instead of the specimen's, are refused).
Measurement read_measurement(const Study& study);

}  // namespace diastole
