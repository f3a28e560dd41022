#pragma once
// Whether the measured points are the specimen's at all: with coordinates in cm, or in other axes, none of them lies on
// the body, and a search would end where it began.

#include <string>

#include "estimator/fit/joint_problem.hpp"
#include "estimator/io/study.hpp"

namespace diastole {

struct PointShare {
  size_t usable = 0;    ///< found on the body
  size_t measured = 0;  ///< in loaded frames
};

/// In the motion of the last `find_points`.
PointShare point_share(const JointProblem& problem);

/// Tags and 3-D points of loaded frames.
size_t loaded_points(const Measurement& measurement);

/// Throws InputError (`file`, the share, what to check) when fewer than half of the points are usable.
void require_half_usable(const PointShare& share, const std::string& file);
/// ... when there are fewer usable numbers than values estimated. Before a search: a poor start may have few points.
void require_any_usable(const JointProblem& problem, const std::string& file);
/// ... when every measured point is of frame 0.
void require_loaded_points(const Study& study, const Measurement& measurement);

}  // namespace diastole
