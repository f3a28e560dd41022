#pragma once
// Tagged images of a ring with known motion, written as DICOM: a ring of gel between water that stirs and water that rests (or air). It inflates as
// an incompressible body does, material (R) at r(t)^2 = R^2 + c(t), so that where each tag is seen is known in closed form.

#include <Eigen/Dense>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace diastole::test {

struct RingScan {
  int phases = 8;
  int pixels = 96;
  double pixel_mm = 1.0;
  double tag_spacing_mm = 5.0;
  double tag_angle_deg = 45.0;  ///< of the stripes' normal from the rows
  double noise = 40.0;          ///< of a channel; gel is 1000
  double most_mm2 = 90.0;       ///< c at its largest
  bool tagged = true;
  int ghost_rows = 0;                  ///< a copy of the picture, so many rows below
  double ghost_share = 0.06;           ///< of its brightness
  double ghost_turn_rad = 0;           ///< its phase against the picture
  std::optional<int> missing_phase{};  ///< from 1
  bool with_times = true;
  double first_ms = 12.0, step_ms = 72.0;
  int series = 2;
  Eigen::Vector3d origin_mm{-47.5, -47.5, 12.0};  ///< of the first pixel
  Eigen::Vector3d along_row{1, 0, 0};             ///< in the plane z = 12, as is the other
  Eigen::Vector3d along_column{0, 1, 0};
  double stretch = 1.0;       ///< rows lie so many times as far apart as columns, and are fewer
  std::string uid = "1.2.3";  ///< what the instances' UIDs begin with
  unsigned seed = 1;

  double inner_mm = 18;
  double gel_T1_s = 0.8;
  double water_mm = 46;  ///< how far the bath reaches; 0: the ring hangs in air
  static constexpr double outer_mm = 38;
  [[nodiscard]] double time_ms(int phase) const { return first_ms + step_ms * (phase - 1); }
  [[nodiscard]] double inflation_mm2(int phase) const;
  /// n . X of the material that is seen at a place (patient coordinates), relative to n . x of the ring's centre at (0, 0).
  [[nodiscard]] double material_mm(int phase, const Eigen::Vector3d& x_mm) const;
  [[nodiscard]] Eigen::Vector3d normal() const;
};

/// Writes NAME1.dcm, NAME2.dcm, ... and returns them.
std::vector<std::filesystem::path> write_ring(const RingScan& scan, const std::filesystem::path& folder,
                                              const std::string& name = "im");

}  // namespace diastole::test
