#include "estimator/imaging/tracking/track_slices.hpp"

#include <fmt/format.h>

#include <map>
#include <mutex>
#include <optional>

#include "estimator/parallel/parallel_for.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::imaging {

std::vector<TagView> tag_views(const ImageFolder& folder) {
  const PhaseTimes phases = tagged_phases(folder);
  std::vector<TagView> views;
  std::map<int, size_t> slices_before;  // of the same number: a series may hold several orientations
  for (const ImageSeries& series : folder.series) {
    if (series.kind != SeriesKind::tagged_cine) continue;
    const size_t before = slices_before[series.number];
    slices_before[series.number] += series.slices.size();
    for (size_t s = 0; s < series.slices.size(); ++s) {
      const SliceImages& slice = series.slices[s];
      if (slice.tags.empty()) continue;
      TagView view;
      view.plane = slice.plane;
      view.waves = slice.tags;
      view.images = folder.pixels(slice.images);
      for (const size_t image : slice.images) {
        view.times_ms.push_back(*folder.images[image].header.trigger_ms);
        view.frames.push_back(static_cast<int>(*phases.index_of(view.times_ms.back())) + 1);
      }
      view.name = fmt::format("series {}, slice {}", series.number, before + s + 1);
      views.push_back(std::move(view));
    }
  }
  if (views.empty())
    throw InputError({folder.folder.string(), "",
                      "holds no tagged cine: no series has several phases with lines of tags in the first",
                      "`diastole images` says what each series was taken for, and why."});
  return views;
}

namespace {

/// Frees what only the points were made of: some 40 MB a slice of 256 x 256 pixels.
void keep_results(TrackedView& tracked) {
  for (TrackedPhase& phase : tracked.phases) {
    phase.materials.resize(0, 0);
    phase.residual.resize(0, 0);
    phase.slope.clear();
  }
  for (MotionField& motion : tracked.motion)
    motion.covariance = {};
}

/// Why no line of a slice has a point: what was found to be no tissue, or not to be trusted.
std::string why_without_points(const TrackedPoints& points) {
  if (points.dropped.empty()) return "no line of tags was found in tissue";
  std::string reasons;
  for (const auto& [reason, count] : points.dropped)
    reasons += fmt::format("{}{} ({})", reasons.empty() ? "" : ", ", reason, count);
  return "none of the places on its lines can be trusted: " + reasons;
}

}  // namespace

std::vector<TrackedSlice> track_views(std::vector<TagView> views, size_t threads,
                                      std::vector<Finding>& problems, const SlicesDone& progress) {
  std::vector<std::optional<TrackingFault>> faults(views.size());
  std::vector<TrackedSlice> slices(views.size());
  std::mutex reporting;
  size_t done = 0;
  const auto report = [&] {
    const std::scoped_lock lock(reporting);
    if (progress) progress(++done, slices.size());
  };
  parallel_for(views.size(), threads, [&](size_t i) {
    slices[i].view = std::move(views[i]);
    slices[i].tracked = track_view(slices[i].view, faults[i]);
    if (!faults[i]) {
      slices[i].points = tag_points(slices[i].view, slices[i].tracked);
      keep_results(slices[i].tracked);
    }
    report();
  });
  std::vector<TrackedSlice> kept;
  for (size_t i = 0; i < slices.size(); ++i) {
    if (faults[i] || slices[i].points.points.empty())
      problems.push_back({Severity::warning, "not-tracked",
                          faults[i] ? faults[i]->reason : why_without_points(slices[i].points),
                          slices[i].view.name, 1, "slices",
                          "Look at the images: is the specimen in the slice, and are its tags still seen in "
                          "the middle of the cycle?"});
    if (!faults[i]) kept.push_back(std::move(slices[i]));
  }
  return kept;
}

}  // namespace diastole::imaging
