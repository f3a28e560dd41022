#pragma once
// A ghost's phase against the picture that it lies over, and images without it.
//
// The magnitude of a picture s under a ghost g = share s' exp(i theta), s' the shifted picture, is |s + g| = s + g cos(theta) where s is
// bright. Smooth brightness and a shift of the tags take up most of g cos(theta) - that is what a ghost does to a line - but not its
// edges. What is left of s' after the same fit is what the residual holds of it, times share cos(theta) (Frisch, Waugh 1933).

#include "estimator/imaging/tracking/tag_tracker.hpp"

namespace diastole::imaging {

/// Sets `ghost.in_phase` and its standard deviation, from the images and what `tracked` left of them. It is the same in all phases, and the
/// phase may be any before; quadrants may differ by more than the scatter of their phases.
void measure_in_phase(const TagView& view, const TrackedView& tracked, Ghost& ghost);

/// The images as they would be without the ghosts, in and around the tissue; elsewhere, where noise is all that is left, as they are.
TagView without_ghosts(const TagView& view, const TrackedView& tracked, const std::vector<Ghost>& ghosts);

}  // namespace diastole::imaging
