#include "estimator/fit/usable_points.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

[[noreturn]] void refuse(const PointShare& share, const std::string& file) {
  throw InputError({file, "measured points of the loaded frames",
                    fmt::format("only {} of {} lie on the specimen", share.usable, share.measured),
                    "Check that coordinates are in mm and in the specimen's own axes, and that its sizes and "
                    "the pressures (kPa) are right; `diastole reconstruct` tells more."});
}

}  // namespace

PointShare point_share(const JointProblem& problem) {
  PointShare share;
  for (const JointProblem::LoadedFrame& frame : problem.frames()) {
    const FoundPoints& found = frame.residuals.found();
    share.usable += found.usable;
    share.measured += found.usable + found.tags_left_out + found.points_left_out;
  }
  return share;
}

size_t loaded_points(const Measurement& measurement) {
  const auto loaded = [](const auto& row) { return row.frame > 0; };
  return static_cast<size_t>(std::count_if(measurement.tags.begin(), measurement.tags.end(), loaded) +
                             std::count_if(measurement.points.begin(), measurement.points.end(), loaded));
}

void require_half_usable(const PointShare& share, const std::string& file) {
  if (2 * share.usable < share.measured || share.usable == 0) refuse(share, file);
}

void require_any_usable(const JointProblem& problem, const std::string& file) {
  Eigen::Index rows = 0;
  for (const JointProblem::LoadedFrame& frame : problem.frames())
    rows += frame.residuals.size();
  if (rows < problem.values()) refuse(point_share(problem), file);
}

void require_loaded_points(const Study& study, const Measurement& measurement) {
  if (loaded_points(measurement) > 0) return;
  throw InputError({study.file.string(), "table [data]",
                    "every measured point is of frame 0, the undeformed state",
                    "Give points of loaded frames: only they tell about stiffness."});
}

}  // namespace diastole
