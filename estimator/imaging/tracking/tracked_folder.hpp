#pragma once
// All that `diastole track` does, from a folder to points in the specimen's coordinates.

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "estimator/imaging/series/image_folder.hpp"
#include "estimator/imaging/series/views.hpp"
#include "estimator/imaging/tracking/manual_edits.hpp"
#include "estimator/imaging/tracking/specimen_pose.hpp"

namespace diastole::imaging {

struct TrackRequest {
  std::filesystem::path folder;
  std::optional<std::filesystem::path> pose =
      {};  ///< absent: the one *.pose.toml beside or in the folder, or what the images show
  std::optional<SpecimenPose> known_pose = {};  ///< comes before any file
  std::string coordinates = "auto";             ///< "specimen": a pose is demanded; "patient": none is used
  std::optional<std::filesystem::path> edits =
      {};  ///< manual choices; absent: those beside the folder, if there are any
};

struct AppliedEdits {
  std::filesystem::path file;
  std::map<std::string, size_t> counts;  ///< by action
  size_t undone = 0;
};

struct TrackedFolder {
  std::filesystem::path folder;
  std::vector<TrackedSlice> slices;
  std::vector<TrackedPoint> points;  ///< in the specimen's coordinates if there is a pose, else the patient's
  std::map<std::string, size_t> dropped;
  std::optional<SpecimenPose> pose;
  std::optional<AnnulusOutline> outline;
  std::optional<AppliedEdits> edits;
  std::vector<Finding> problems;
  double rms_px = 0;  ///< of the points' standard errors
};

/// All *.pose.toml in the folder and beside it. Of several none is the session's.
std::vector<std::filesystem::path> poses_nearby(const std::filesystem::path& folder);

/// The pose that the request names or that lies nearby; none if that is for the images to show. Throws InputError as read_pose.
std::optional<SpecimenPose> stated_pose(const TrackRequest& request, std::vector<Finding>& problems);

struct PhaseSummary {
  int frame;
  double trigger_ms;
  size_t points;
  double sigma_px;  ///< root mean square
  double residual;  ///< standard deviation, in the image's units
};
std::vector<PhaseSummary> phase_summaries(const TrackedSlice& slice);

using Stage = std::function<void(const std::string& stage)>;

/// The file of manual choices that a request means, whether or not it is there.
std::filesystem::path edits_file(const TrackRequest& request);
/// Its choices, none if it is not there and was not named; set in the views. Throws InputError.
ManualEdits use_edits(const TrackRequest& request, std::vector<TagView>& views);

/// Points and pose of slices that are tracked; what stated_pose found is the request's known one. Throws InputError if no point is left, or a demanded pose is not seen.
TrackedFolder gathered(const TrackRequest& request, const ManualEdits& edits,
                       std::vector<TrackedSlice> slices, std::vector<Finding> problems);

/// Throws InputError for a folder that is not sound, without tags, or of which nothing could be tracked, and for manual choices that do
/// not fit it.
TrackedFolder track_folder(const TrackRequest& request, const Stage& stage = {});
/// The same of a folder that is read.
TrackedFolder track_folder(const TrackRequest& request, const ImageFolder& folder, const Stage& stage = {});

}  // namespace diastole::imaging
