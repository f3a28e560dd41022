#pragma once
// Imaged motion of a ventricle with an effect hidden in it, solved on another mesh than the study's, as a folder with a study.

#include <array>
#include <cstdint>
#include <filesystem>

#include "estimator/effects/field_model.hpp"
#include "estimator/io/study.hpp"

namespace diastole::test {

struct SimulatedVentricle {
  FieldModel truth = {};  ///< none: the base model
  /// What no effect of the library is: the base and all that hangs from it turns about the axis, at the highest pressure.
  double twist_deg = 0.0;
  double sag_mm = 0.0;  ///< sideways at the apex, growing with the square of the distance from the base
  std::array<double, 4> law{3.0, 11.0, 1.8, 10.0};  ///< C_kPa, b1, b2, b3
  double sigma_mm = 0.3;
  size_t points = 1500;  ///< a frame
  std::uint64_t seed = 1;
  const char* mesh = "10, 5, 3";  ///< on which it is solved
};

/// A truncated ellipsoid with fibres from 60 to -60 degrees, of Guccione's law (shared by all tests), in five frames up to 2 kPa. Writes
/// its files into `folder` and returns its study.
Study simulated(const SimulatedVentricle& ventricle, const std::filesystem::path& folder);

}  // namespace diastole::test
