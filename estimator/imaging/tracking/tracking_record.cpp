#include "estimator/imaging/tracking/tracking_record.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/imaging/series/grey_picture.hpp"
#include "estimator/imaging/tracking/outline.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole::imaging {
namespace {

TrackedSliceImages slice_record(const TrackedSlice& slice, const std::vector<DroppedCount>& dropped) {
  const SlicePlane& plane = slice.view.plane;
  TrackedSliceImages record;
  record.name = slice.view.name;
  record.view = orientation_in_words(plane);
  record.rows = plane.rows;
  record.columns = plane.columns;
  record.pixel_mm = {plane.column_spacing_mm, plane.row_spacing_mm};
  for (const TagWave& wave : slice.tracked.waves)
    record.directions.push_back(
        {std::atan2(wave.per_mm.y(), wave.per_mm.x()) / rad_per_deg, wave.spacing_mm()});
  const float white = white_of(slice.view.images);
  const std::vector<PhaseSummary> summaries = phase_summaries(slice);
  for (size_t k = 0; k < slice.view.images.size(); ++k) {
    TrackedImage image;
    image.frame = slice.view.frames[k];
    image.trigger_ms = slice.view.times_ms[k];
    image.sigma_px = summaries[k].sigma_px;
    image.residual = 100 * summaries[k].residual / static_cast<double>(white);
    image.picture = grey_picture(slice.view.images[k], white);
    for (const TrackedPoint& point : slice.points.points) {
      if (point.frame != image.frame) continue;
      const Eigen::Vector2d pixel = plane.pixel(point.x_mm);
      for (const double number : {static_cast<double>(point.direction), static_cast<double>(point.tag),
                                  pixel.x(), pixel.y(), point.sigma_mm / plane.finer_spacing_mm()})
        image.points.push_back(number);
    }
    for (const RejectedPoint& point : slice.points.rejected) {
      if (point.frame != image.frame) continue;
      const auto reason = std::find_if(dropped.begin(), dropped.end(), [&](const DroppedCount& count) {
        return count.reason == point.reason;
      });
      for (const double number :
           {static_cast<double>(point.direction), static_cast<double>(reason - dropped.begin()),
            point.x_mm.x() / plane.column_spacing_mm, point.x_mm.y() / plane.row_spacing_mm})
        image.rejected.push_back(number);
    }
    for (const auto& outline : outlines_px(slice.tracked.phases[k].depth_mm)) {
      std::vector<double>& numbers = image.outlines.emplace_back();
      for (const Eigen::Vector2d& point : outline)
        numbers.insert(numbers.end(), {point.x(), point.y()});
    }
    record.images.push_back(std::move(image));
  }
  return record;
}

}  // namespace

TrackingRecord tracking_record(const TrackedFolder& tracked, double seconds) {
  TrackingRecord record;
  record.folder = tracked.folder.string();
  record.coordinates = tracked.pose ? "specimen" : "patient";
  record.points = tracked.points.size();
  record.rms_px = tracked.rms_px;
  record.seconds = seconds;
  if (tracked.edits) {
    record.edits = 0;
    for (const auto& [action, count] : tracked.edits->counts)
      *record.edits += count;
  }
  for (const auto& [reason, points] : tracked.dropped)
    record.dropped.push_back({reason, points});
  record.findings = tracked.problems;
  for (const TrackedSlice& slice : tracked.slices)
    record.slices.push_back(slice_record(slice, record.dropped));
  return record;
}

}  // namespace diastole::imaging
