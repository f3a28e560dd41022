#pragma once
// One slice with its tag directions over the cycle: what is tracked at once.

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "estimator/imaging/series/tag_waves.hpp"

namespace diastole::imaging {

using PixelMask = Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>;

/// A place where a person saw a tag.
struct SeenTag {
  int direction;  ///< among the view's waves
  int tag;        ///< number of its line
  Eigen::Vector2d x_mm;
};

/// What a person put right in one image.
struct PhaseEdits {
  PixelMask masked = {};  ///< pixels that do not count; empty if all do
  std::vector<SeenTag> seen = {};
  std::optional<PixelMask> within_inner = {};  ///< the inside of a wall's contour that was drawn
  std::optional<PixelMask> within_outer = {};
};

struct TagView {
  SlicePlane plane;
  std::vector<Image> images;             ///< of the phases that there are, in order of time
  std::vector<double> times_ms;          ///< since the tags were made
  std::vector<int> frames;               ///< phase numbers, from 1
  std::vector<TagWave> waves;            ///< of the first image: one direction, or two of a grid
  std::string name;                      ///< "series 2, slice 1"
  std::vector<PhaseEdits> edits = {};    ///< one an image, or none at all
  std::optional<double> height_mm = {};  ///< over the specimen's mid-height, as a person knows it

  [[nodiscard]] Eigen::Vector2d place_mm(Eigen::Index row, Eigen::Index column) const {
    return {static_cast<double>(column) * plane.column_spacing_mm,
            static_cast<double>(row) * plane.row_spacing_mm};
  }
  [[nodiscard]] bool is_masked(size_t phase, Eigen::Index row, Eigen::Index column) const {
    return !edits.empty() && edits[phase].masked.size() > 0 && edits[phase].masked(row, column);
  }
  [[nodiscard]] Eigen::Vector2d extent_mm() const { return place_mm(plane.rows - 1, plane.columns - 1); }
  /// A pixel counts as surely tissue this far inside: a pixel's half width and the point spread of a matrix that is half filled.
  [[nodiscard]] double sure_mm() const {
    return 1.25 * std::max(plane.row_spacing_mm, plane.column_spacing_mm);
  }
};

}  // namespace diastole::imaging
