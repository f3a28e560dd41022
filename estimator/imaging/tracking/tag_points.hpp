#pragma once
// Points on the tracked tag lines, in patient coordinates, and those that cannot be trusted.

#include <map>
#include <string>
#include <vector>

#include "estimator/imaging/tracking/tag_tracker.hpp"

namespace diastole::imaging {

/// A place where a tag is seen: its material lay on the plane  normal . X = plane_mm  when the tags were made.
struct TagPoint {
  int frame = 0;
  Eigen::Vector3d normal;  ///< unit
  double plane_mm = 0;
  Eigen::Vector3d x_mm;
  double sigma_mm = 0;  ///< standard deviation along the normal
};

struct TagPoints {
  std::vector<TagPoint> points;
  std::map<std::string, size_t> dropped;  ///< by reason
};

/// Evenly along every piece of line in tissue, about four fifths of the tag spacing apart.
TagPoints tag_points(const TagView& view, const TrackedView& tracked);

}  // namespace diastole::imaging
