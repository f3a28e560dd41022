#pragma once
// What belongs together in a scanner's export: images of one series, one kind of picture, one orientation.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "estimator/imaging/dicom/dicom_file.hpp"
#include "estimator/imaging/series/phase_times.hpp"
#include "estimator/imaging/series/tag_waves.hpp"

namespace diastole::imaging {

struct ImageOfFolder {
  size_t file = 0;  ///< index into ImageFolder::files
  ImageHeader header;
};

enum class SeriesKind { tagged_cine, cine, velocity, diffusion, anatomy };
std::string describe(SeriesKind kind);

/// One place; its images by phase. A phase that is absent has no image.
struct SliceImages {
  SlicePlane plane;
  std::vector<size_t> images;      ///< into ImageFolder::images, by trigger time
  std::vector<TagWave> tags = {};  ///< of a tagged cine, from its first phase
};

struct ImageSeries {
  SeriesKind kind = SeriesKind::anatomy;
  std::string reason;               ///< why it is taken for that
  int number = 0;                   ///< SeriesNumber
  std::vector<SliceImages> slices;  ///< by place along the normal
  PhaseTimes phases;
  std::optional<double> interval_ms;  ///< the cycle
  std::optional<VelocityEncoding> velocity;
  std::vector<double> b_s_mm2;  ///< of diffusion: those that occur
  std::vector<size_t> files;    ///< into ImageFolder::files
  std::string vendor;

  [[nodiscard]] const SlicePlane& plane() const { return slices.front().plane; }
  /// The slice whose tags stand out most; of equals, such as those without, the middle one.
  [[nodiscard]] const SliceImages& clearest() const;
};

}  // namespace diastole::imaging
