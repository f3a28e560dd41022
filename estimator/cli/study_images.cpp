#include "estimator/cli/study_images.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>

#include "estimator/cli/output_files.hpp"
#include "estimator/imaging/series/image_folder.hpp"
#include "estimator/imaging/tracking/tags_file.hpp"
#include "estimator/imaging/tracking/tracked_folder.hpp"
#include "estimator/imaging/tracking/tracking_record.hpp"
#include "estimator/io/fingerprint.hpp"
#include "estimator/io/measurement.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

/// Another number whenever the tracker gives other points for the same images.
constexpr int tracker_version = 7;

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
std::vector<Finding> frames_at_other_times(const Study& study, const imaging::ImageFolder& folder) {
  if (!study.data.frames) return {};
  const std::vector<Frame> frames = read_frames(*study.data.frames);
  const std::vector<double> phase_ms = imaging::tagged_phases(folder).times_ms;
  for (size_t frame = 1; frame <= phase_ms.size() && frame < frames.size(); ++frame) {
    const double stated_ms = 1e3 * frames[frame].time_s;
    const auto nearest =
        std::ranges::min_element(phase_ms, {}, [&](double ms) { return std::abs(ms - stated_ms); });
    const auto phase = static_cast<size_t>(nearest - phase_ms.begin()) + 1;
    if (phase == frame) continue;
    return {{Severity::warning, "frame-at-another-time",
             fmt::format("frame {} is at {:.0f} ms, and the images' phase {} at {:.0f} ms: does its pressure "
                         "belong to phase {}?",
                         frame, stated_ms, frame, phase_ms[frame - 1], phase),
             study.data.frames->string(), stated_ms - phase_ms[frame - 1], "ms",
             "Number frames as the images' phases, at their times since the trigger."}};
  }
  return {};
}

/// Tags of another spacing than the study's are those of another protocol, or their harmonics.
void require_spacing(const Study& study, const imaging::ImageFolder& folder) {
  if (!study.data.tag_spacing_mm) return;
  for (const double spacing_mm : imaging::tag_spacings_mm(folder))
    if (!imaging::is_tag_spacing(spacing_mm, *study.data.tag_spacing_mm))
      throw InputError({study.file.string(), "[images] tag_spacing_mm",
                        fmt::format("says {:g} mm, and the images in {} have tags every {:.2f} mm",
                                    *study.data.tag_spacing_mm, folder.folder.string(), spacing_mm),
                        "Are these the images of this study? If so, correct the spacing or leave it out."});
}

}  // namespace

std::optional<std::filesystem::path> use_images(Study& study) {
  if (!study.data.images) return std::nullopt;
  const std::filesystem::path folder = *study.data.images;
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error))
    throw InputError({study.file.string(), "[data] images", fmt::format("{} is no folder", folder.string()),
                      "Name the scanner's export: images = \"dicom/\"."});
  fmt::print(stderr, "Images: reading the folder.\n");
  const imaging::ImageFolder images = imaging::read_image_folder(folder);
  require_spacing(study, images);
  print_findings(frames_at_other_times(study, images), stderr);
  const auto pose = pose_of(study);
  std::string name = study.file.filename().string();
  name = name.substr(0, name.find(".study.toml"));
  const std::filesystem::path kept =
      study.file.parent_path() / fmt::format("{}.images-{}", name, fingerprint_of(folder, pose));
  const std::filesystem::path record = kept.string() + ".tracking.json";
  study.data.tags = kept.string() + ".tags.csv";
  if (std::filesystem::is_regular_file(*study.data.tags) && std::filesystem::is_regular_file(record)) {
    fmt::print(stderr, "Tags of these images are in {}.\n", study.data.tags->string());
    return record;
  }
  const auto start = std::chrono::steady_clock::now();
  const imaging::TrackedFolder tracked = imaging::track_folder(
      {.folder = folder, .pose = {}, .known_pose = pose, .coordinates = "specimen"}, images,
      [](const std::string& stage) { fmt::print(stderr, "Images: {}.\n", stage); });
  write_whole_file(*study.data.tags, imaging::tags_file_text(tracked.points));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  write_whole_file(record, to_json(imaging::tracking_record(tracked, took.count())));
  fmt::print(stderr, "{} tag points, standard errors {:.3f} px RMS, are in {}.\n", tracked.points.size(),
             tracked.rms_px, study.data.tags->string());
  print_findings(tracked.problems, stderr);
  return record;
}

}  // namespace diastole
