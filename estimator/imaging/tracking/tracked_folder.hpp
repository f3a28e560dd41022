#pragma once
// All that `diastole track` does, from a folder to points in the specimen's coordinates.

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "estimator/imaging/series/views.hpp"
#include "estimator/imaging/tracking/specimen_pose.hpp"

namespace diastole::imaging {

struct TrackRequest {
  std::filesystem::path folder;
  std::optional<std::filesystem::path> pose =
      {};  ///< absent: the one *.pose.toml beside or in the folder, or what the images show
  std::optional<SpecimenPose> known_pose = {};  ///< comes before any file
  std::string coordinates = "auto";             ///< "specimen": a pose is demanded; "patient": none is used
};

struct TrackedFolder {
  std::filesystem::path folder;
  std::vector<TrackedSlice> slices;
  std::vector<TagPoint> points;  ///< in the specimen's coordinates if there is a pose, else the patient's
  std::map<std::string, size_t> dropped;
  std::optional<SpecimenPose> pose;
  std::optional<AnnulusOutline> outline;
  std::vector<Finding> problems;
  double rms_px = 0;  ///< of the points' standard errors
};

/// The one *.pose.toml in the folder or beside it.
std::optional<std::filesystem::path> pose_nearby(const std::filesystem::path& folder);

struct PhaseSummary {
  int frame;
  double trigger_ms;
  size_t points;
  double sigma_px;  ///< root mean square
  double residual;  ///< standard deviation, in the image's units
};
std::vector<PhaseSummary> phase_summaries(const TrackedSlice& slice);

using Stage = std::function<void(const std::string& stage)>;

/// Throws InputError for a folder that is not sound, without tags, or of which nothing could be tracked.
TrackedFolder track_folder(const TrackRequest& request, const Stage& stage = {});

}  // namespace diastole::imaging
