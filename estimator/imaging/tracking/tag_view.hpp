#pragma once
// One slice with its tag directions over the cycle: what is tracked at once.

#include <string>
#include <vector>

#include "estimator/imaging/series/tag_waves.hpp"

namespace diastole::imaging {

struct TagView {
  SlicePlane plane;
  std::vector<Image> images;     ///< of the phases that there are, in order of time
  std::vector<double> times_ms;  ///< since the tags were made
  std::vector<int> frames;       ///< phase numbers, from 1
  std::vector<TagWave> waves;    ///< of the first image: one direction, or two of a grid
  std::string name;              ///< "series 2, slice 1"

  [[nodiscard]] Eigen::Vector2d place_mm(Eigen::Index row, Eigen::Index column) const {
    return {static_cast<double>(column) * plane.column_spacing_mm,
            static_cast<double>(row) * plane.row_spacing_mm};
  }
  [[nodiscard]] Eigen::Vector2d extent_mm() const { return place_mm(plane.rows - 1, plane.columns - 1); }
};

}  // namespace diastole::imaging
