#include "estimator/cli/study_images.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "estimator/cli/output_files.hpp"
#include "estimator/imaging/series/image_folder.hpp"
#include "estimator/imaging/tracking/tags_file.hpp"
#include "estimator/imaging/tracking/tracked_folder.hpp"
#include "estimator/io/fingerprint.hpp"
#include "estimator/io/measurement.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

/// Another number whenever the tracker gives other points for the same images.
constexpr int tracker_version = 4;

std::optional<imaging::SpecimenPose> pose_of(const Study& study) {
  if (!study.data.to_specimen) return std::nullopt;
  const StudyPose& stated = *study.data.to_specimen;
  imaging::SpecimenPose pose;
  pose.origin_mm = Eigen::Map<const Eigen::Vector3d>(stated.origin_mm.data());
  for (size_t i = 0; i < 3; ++i)
    pose.axes.col(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::Vector3d>(stated.axes[i].data());
  pose.source = study.file.string();
  return pose;
}

std::string fingerprint_of(const std::filesystem::path& folder,
                           const std::optional<imaging::SpecimenPose>& pose) {
  std::error_code error;
  std::vector<std::filesystem::path> files = imaging::files_below(folder);
  std::ranges::copy(imaging::poses_nearby(folder), std::back_inserter(files));
  if (const auto edits = imaging::edits_beside(folder); std::filesystem::exists(edits, error))
    files.push_back(edits);
  std::sort(files.begin(), files.end());
  Fingerprint fingerprint;
  fingerprint.add(fmt::format("tracker {}", tracker_version));
  if (pose) fingerprint.add(imaging::pose_text(*pose, ""));
  for (const std::filesystem::path& file : files)
    fingerprint.add(read_whole_file(file));
  return fingerprint.text();
}

/// Frames are the images' phases, by number. Of one whose time is nearer to another phase's the pressure is another's, too.
std::optional<Finding> frame_at_another_time(const Study& study, const imaging::TrackedFolder& tracked) {
  if (!study.data.frames) return std::nullopt;
  const std::vector<Frame> frames = read_frames(*study.data.frames);
  std::map<int, double> phase_ms;
  for (const imaging::TrackedSlice& slice : tracked.slices)
    for (size_t k = 0; k < slice.view.frames.size(); ++k)
      phase_ms[slice.view.frames[k]] = slice.view.times_ms[k];
  for (const auto& [frame, time_ms] : phase_ms) {
    if (frame >= static_cast<int>(frames.size())) break;
    const double stated_ms = 1e3 * frames[static_cast<size_t>(frame)].time_s;
    const auto nearest = std::ranges::min_element(
        phase_ms, {}, [&](const auto& phase) { return std::abs(phase.second - stated_ms); });
    if (nearest->first == frame) continue;
    return Finding{Severity::warning,
                   "frame-at-another-time",
                   fmt::format("frame {} is at {:.0f} ms, and the images' phase {} at {:.0f} ms: does its "
                               "pressure belong to phase {}?",
                               frame, stated_ms, frame, time_ms, nearest->first),
                   study.data.frames->string(),
                   stated_ms - time_ms,
                   "ms",
                   "Number frames as the images' phases, at their times since the trigger."};
  }
  return std::nullopt;
}

}  // namespace

void use_images(Study& study) {
  if (!study.data.images) return;
  const std::filesystem::path folder = *study.data.images;
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error))
    throw InputError({study.file.string(), "[data] images", fmt::format("{} is no folder", folder.string()),
                      "Name the scanner's export: images = \"dicom/\"."});
  const auto pose = pose_of(study);
  std::string name = study.file.filename().string();
  name = name.substr(0, name.find(".study.toml"));
  study.data.tags =
      study.file.parent_path() / fmt::format("{}.images-{}.tags.csv", name, fingerprint_of(folder, pose));
  if (std::filesystem::is_regular_file(*study.data.tags)) {
    fmt::print(stderr, "Tags of these images are in {}.\n", study.data.tags->string());
    return;
  }
  imaging::TrackedFolder tracked =
      imaging::track_folder({.folder = folder, .pose = {}, .known_pose = pose, .coordinates = "specimen"},
                            [](const std::string& stage) { fmt::print(stderr, "Images: {}.\n", stage); });
  write_whole_file(*study.data.tags, imaging::tags_file_text(tracked.points));
  fmt::print(stderr, "{} tag points, standard errors {:.3f} px RMS, are in {}.\n", tracked.points.size(),
             tracked.rms_px, study.data.tags->string());
  if (const auto apart = frame_at_another_time(study, tracked)) tracked.problems.push_back(*apart);
  print_findings(tracked.problems, stderr);
}

}  // namespace diastole
