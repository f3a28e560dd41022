#pragma once
// Points on the tracked tag lines, in patient coordinates, and those that cannot be trusted.

#include <map>
#include <string>
#include <vector>

#include "estimator/imaging/tracking/tag_tracker.hpp"

namespace diastole::imaging {

/// A place where a tag is seen: its material lay on the plane  normal . X = plane_mm  when the tags were made. tags_file.hpp writes
/// it, and TagPoint (estimator/io/measurement.hpp) is what a fit reads of that row.
struct TrackedPoint {
  int frame = 0;
  int direction = 0;       ///< among the view's waves
  int tag = 0;             ///< number of its line
  Eigen::Vector3d normal;  ///< unit
  double plane_mm = 0;
  Eigen::Vector3d x_mm;
  double sigma_mm = 0;  ///< standard deviation along the normal
  double own_mm =
      0;  ///< how much farther along the normal the image has the tag by the pixels around this point alone
  double own_sigma_mm = 0;  ///< standard deviation of that place, independent of all other points
};

/// A place on a line that cannot be trusted.
struct RejectedPoint {
  int frame;
  int direction;
  Eigen::Vector2d x_mm;  ///< within the slice
  std::string reason;
};

struct TrackedPoints {
  std::vector<TrackedPoint> points;
  std::vector<RejectedPoint> rejected;
  std::map<std::string, size_t> dropped;  ///< by reason
};

/// Evenly along every piece of line in tissue, about four fifths of the tag spacing apart.
TrackedPoints tag_points(const TagView& view, const TrackedView& tracked);

}  // namespace diastole::imaging
