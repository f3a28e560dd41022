#pragma once
// From a folder of images to tag points: every slice and direction of its tagged cines.

#include <functional>
#include <string>
#include <vector>

#include "estimator/imaging/series/image_folder.hpp"
#include "estimator/imaging/tracking/tag_points.hpp"

namespace diastole::imaging {

struct TrackedSlice {
  TagView view;
  TrackedView tracked;
  TrackedPoints points;
};

/// The tagged slices of a folder with their pixels, frames numbered by the phases of all of them together. Throws InputError if there
/// are none.
std::vector<TagView> tag_views(const ImageFolder& folder);

/// How many slices are done; called by several threads, one at a time. What it throws ends the work.
using SlicesDone = std::function<void(size_t done, size_t all)>;

/// Tracks all views on `threads` threads. Of each `TrackedSlice::tracked` the motion is kept, and of each phase its noise and the
/// tissue's depth. A slice in which no tissue is found is left out; it and one that has no point are reported in `problems`.
std::vector<TrackedSlice> track_views(std::vector<TagView> views, size_t threads,
                                      std::vector<Finding>& problems, const SlicesDone& progress = {});

}  // namespace diastole::imaging
