#include "estimator/imaging/tracking/tracked_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimator/io/whole_file.hpp"
#include "estimator/parallel/parallel_for.hpp"
#include "protocol/contract/angle.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::imaging {
namespace {

namespace fs = std::filesystem;

/// The pose that was stated or that the images show, and what is to be said about it.
void settle_pose(const TrackRequest& request, TrackedFolder& tracked) {
  if (request.coordinates == "patient") return;
  const FoundPose found = find_annulus_pose(tracked.slices);
  tracked.outline = found.outline;
  if (request.known_pose) {
    tracked.pose = request.known_pose;
    if (!found.pose) return;
    const double apart_mm = (tracked.pose->origin_mm - found.pose->origin_mm).norm();
    const double turned_deg =
        std::acos(std::min(1.0, std::abs(tracked.pose->axes.col(2).dot(found.pose->axes.col(2))))) /
        rad_per_deg;
    // The outlines are good to a fraction of a pixel, and an operator's marks to about a pixel.
    if (apart_mm > 2 || turned_deg > 2)
      tracked.problems.push_back(
          {Severity::warning, "pose-beside-outline",
           fmt::format("the pose lies {:.1f} mm and {:.1f} degrees from what the outlines show", apart_mm,
                       turned_deg),
           tracked.pose->source, apart_mm, "mm",
           "Is it the pose of this session? Leave it out to use the outlines."});
    return;
  }
  tracked.pose = found.pose;
  if (tracked.pose) return;
  if (request.coordinates == "specimen")
    throw InputError({request.folder.string(), "", "the specimen's pose is not seen: " + found.missing,
                      found.remedy + " Or ask for --coords patient."});
  tracked.problems.push_back({Severity::warning, "patient-coordinates",
                              "the points stay in patient coordinates: " + found.missing,
                              request.folder.string(), 0, "", found.remedy});
}

/// A slice that reaches beyond the specimen's end shows the mean motion of what is in it, which is not that of its middle.
void find_slices_at_ends(TrackedFolder& tracked) {
  if (!tracked.pose || !tracked.outline) return;
  const Eigen::Vector3d axis = tracked.pose->axes.col(2);
  for (const TrackedSlice& slice : tracked.slices) {
    const SlicePlane& plane = slice.view.plane;
    const double cosine = std::abs(plane.normal().dot(axis));
    if (cosine < 0.9) continue;  // along the axis
    const double height_mm =
        std::abs((plane.at(0.5 * slice.view.extent_mm()) - tracked.pose->origin_mm).dot(plane.normal())) /
        cosine;
    const double beyond_mm = height_mm + 0.5 * plane.thickness_mm - 0.5 * tracked.outline->height_mm;
    if (beyond_mm <= slice.view.plane.finer_spacing_mm()) continue;  // outlines are good to a pixel
    tracked.problems.push_back(
        {Severity::warning, "slice-at-end",
         fmt::format(
             "the slice is {:.1f} mm thick and reaches {:.1f} mm beyond the specimen's end: its tags move as "
             "what is left within does",
             plane.thickness_mm, beyond_mm),
         slice.view.name, beyond_mm, "mm",
         "Mask it in all phases (docs/imaging.md, put right by hand), or leave its files out."});
  }
}

}  // namespace

std::vector<fs::path> poses_nearby(const fs::path& folder) {
  std::vector<fs::path> found;
  const fs::path whole = fs::absolute(folder).lexically_normal();
  const fs::path inside = whole.has_filename() ? whole : whole.parent_path();
  for (const fs::path& place : {inside, inside.parent_path()}) {
    std::error_code error;
    for (fs::directory_iterator at(place, error), end; !error && at != end; at.increment(error)) {
      if (at->path().filename().string().ends_with(".pose.toml")) found.push_back(at->path());
    }
  }
  std::ranges::sort(found);
  return found;
}

std::optional<SpecimenPose> stated_pose(const TrackRequest& request, std::vector<Finding>& problems) {
  if (request.coordinates == "patient") return std::nullopt;
  if (request.known_pose) return request.known_pose;
  if (request.pose) return read_pose(*request.pose);
  const std::vector<fs::path> nearby = poses_nearby(request.folder);
  if (nearby.size() == 1) return read_pose(nearby[0]);
  if (!nearby.empty())
    problems.push_back(
        {Severity::warning, "several-poses",
         fmt::format("{} poses lie here, and which is this session's is not known: none is used",
                     nearby.size()),
         nearby[0].string(), static_cast<double>(nearby.size()), "files",
         "Leave one only, name it to `track` with --pose, or write [images.to_specimen] in the study."});
  return std::nullopt;
}

std::vector<PhaseSummary> phase_summaries(const TrackedSlice& slice) {
  std::vector<PhaseSummary> summaries;
  const double pixel_mm = slice.view.plane.finer_spacing_mm();
  for (size_t k = 0; k < slice.view.frames.size(); ++k) {
    PhaseSummary summary{slice.view.frames[k], slice.view.times_ms[k], 0, 0, slice.tracked.phases[k].noise};
    for (const TrackedPoint& point : slice.points.points) {
      if (point.frame != summary.frame) continue;
      ++summary.points;
      summary.sigma_px += std::pow(point.sigma_mm / pixel_mm, 2);
    }
    if (summary.points > 0)
      summary.sigma_px = std::sqrt(summary.sigma_px / static_cast<double>(summary.points));
    summaries.push_back(summary);
  }
  return summaries;
}

fs::path edits_file(const TrackRequest& request) {
  return request.edits.value_or(edits_beside(request.folder));
}

ManualEdits use_edits(const TrackRequest& request, std::vector<TagView>& views) {
  const fs::path file = edits_file(request);
  std::error_code error;
  ManualEdits edits{file, {}, 0};
  if (request.edits || fs::exists(file, error))
    edits = parse_edits(read_whole_file(file, "Manual choices are a file of JSON lines (docs/imaging.md)."),
                        file);
  apply_edits(edits, views);
  return edits;
}

TrackedFolder gathered(const TrackRequest& request, const ManualEdits& edits,
                       std::vector<TrackedSlice> slices, std::vector<Finding> problems) {
  TrackedFolder tracked;
  tracked.folder = request.folder;
  tracked.problems = std::move(problems);
  tracked.slices = std::move(slices);
  if (!edits.standing.empty() || edits.undone > 0)
    tracked.edits = AppliedEdits{edits.file, counts_of(edits), edits.undone};
  settle_pose(request, tracked);
  find_slices_at_ends(tracked);
  double squares = 0;
  for (const TrackedSlice& slice : tracked.slices) {
    for (const TrackedPoint& point : slice.points.points) {
      tracked.points.push_back(tracked.pose ? tracked.pose->to_specimen(point) : point);
      squares += std::pow(point.sigma_mm / slice.view.plane.finer_spacing_mm(), 2);
    }
    for (const auto& [reason, count] : slice.points.dropped)
      tracked.dropped[reason] += count;
  }
  if (tracked.points.empty())
    throw InputError({request.folder.string(), "", "no tag could be followed in any slice",
                      tracked.problems.empty() ? "Look at the images." : tracked.problems.back().what});
  std::stable_sort(tracked.points.begin(), tracked.points.end(),
                   [](const TrackedPoint& a, const TrackedPoint& b) { return a.frame < b.frame; });
  tracked.rms_px = std::sqrt(squares / static_cast<double>(tracked.points.size()));
  return tracked;
}

TrackedFolder track_folder(const TrackRequest& request, const Stage& stage) {
  if (stage) stage("reading the folder");
  return track_folder(request, read_image_folder(request.folder), stage);
}

TrackedFolder track_folder(const TrackRequest& request, const ImageFolder& folder, const Stage& stage) {
  const auto say = [&](const std::string& text) {
    if (stage) stage(text);
  };
  require_sound(folder);
  std::vector<Finding> problems = folder.problems;
  TrackRequest settled = request;
  settled.known_pose = stated_pose(request, problems);
  std::vector<TagView> views = tag_views(folder);
  const ManualEdits edits = use_edits(request, views);
  if (!edits.standing.empty())
    say(fmt::format("{} manual choices of {}", edits.standing.size(), edits.file.string()));
  say(fmt::format("tracking {} slices", views.size()));
  std::vector<TrackedSlice> slices =
      track_views(std::move(views), machine_threads(), problems, [&](size_t done, size_t all) {
        if (done < all) say(fmt::format("{} of {} slices are tracked", done, all));
      });
  return gathered(settled, edits, std::move(slices), std::move(problems));
}

}  // namespace diastole::imaging
