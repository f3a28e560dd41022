#include "estimator/cli/study_images.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "estimator/imaging/series/image_folder.hpp"
#include "estimator/imaging/tracking/tags_file.hpp"
#include "estimator/imaging/tracking/tracked_folder.hpp"
#include "estimator/io/fingerprint.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

/// Another number whenever the tracker gives other points for the same images.
constexpr int tracker_version = 4;

std::optional<imaging::SpecimenPose> stated_pose(const Study& study) {
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
  if (!std::filesystem::is_directory(folder, error))
    throw InputError(
        {folder.string(), "", "is no folder", "Name the scanner's export: images = \"dicom/\"."});
  std::vector<std::filesystem::path> files = imaging::files_below(folder);
  if (const auto beside = imaging::pose_nearby(folder)) files.push_back(*beside);
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

}  // namespace

void use_images(Study& study) {
  if (!study.data.images) return;
  const std::filesystem::path folder = *study.data.images;
  const auto pose = stated_pose(study);
  std::string name = study.file.filename().string();
  name = name.substr(0, name.find(".study.toml"));
  study.data.tags =
      study.file.parent_path() / fmt::format("{}.images-{}.tags.csv", name, fingerprint_of(folder, pose));
  if (std::filesystem::is_regular_file(*study.data.tags)) {
    fmt::print(stderr, "Tags of these images are in {}.\n", study.data.tags->string());
    return;
  }
  const imaging::TrackedFolder tracked =
      imaging::track_folder({.folder = folder, .pose = {}, .known_pose = pose, .coordinates = "specimen"},
                            [](const std::string& stage) { fmt::print(stderr, "Images: {}.\n", stage); });
  write_whole_file(*study.data.tags, imaging::tags_file_text(tracked.points));
  fmt::print(stderr, "{} tag points, standard errors {:.3f} px RMS, are in {}.\n", tracked.points.size(),
             tracked.rms_px, study.data.tags->string());
  for (const Finding& problem : tracked.problems)
    fmt::print(stderr, "{}: {} [{}]\n", describe(problem.severity), problem.what, problem.where);
}

}  // namespace diastole
