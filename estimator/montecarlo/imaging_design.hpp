#pragma once
// Which tagged images would determine a study's parameters best, before the magnet is booked.
//
// A tag of modulation m(t) = exp(-t / T1) is seen as brightness 1 - m (1 + cos phi) / 2, phi = 2 pi w / spacing + ..., in noise of 1 / snr
// in each pixel. Its slope by the motion w is (pi m / spacing) sin phi, so that an area A of tissue gives
//
//   1 / sigma^2 = (pi m snr / spacing)^2 / 2 * A / pixel^2                                                (1/mm^2)
//
// of w there, independently of its neighbours: what the tracker's own errors are (estimator/imaging/tracking/tag_points.hpp).
// Points stand on the lines, four fifths of the spacing apart; the tags at rest are as unknown as in a fit of images
// (estimator/motion_residuals/tag_planes.hpp).

#include "estimator/mesh/hermite_mesh.hpp"
#include "estimator/montecarlo/design.hpp"

namespace diastole {

struct ImagingPlan {
  std::vector<double> short_axis_mm = {0.0};  ///< heights of slices across z
  std::vector<double> long_axis_deg = {};     ///< slices along z, turned about it from x
  double tag_spacing_mm = 5.0;
  std::vector<double> tag_angles_deg = {45.0, -45.0};  ///< of the tags' normals from the image's rows
  double pixel_mm = 1.0;
  double snr = 20.0;
  double T1_s = 0.8;
};

/// The tag points that the plan sees of the undeformed body in each loaded frame, each with its own error in that frame.
/// Tissue nearer than a pixel and a quarter to an edge gives nothing: it shares its pixels.
Measurement planned_tags(const HermiteMesh& mesh, const ImagingPlan& plan, const std::vector<Frame>& frames);

/// Predicted standard errors at the study's start values, and what changes of the plan would make them. Frames: the study's, with
/// their times and pressures. Throws InputError without equilibrium there, for a plan that sees nothing of a parameter, and for
/// tags less than three pixels apart.
/// `unload`: as explore_design's; the tags are then laid in the shape of the image.
DesignStudy explore_imaging(const Study& study, const std::vector<Frame>& frames, const ImagingPlan& plan,
                            bool unload = false);

}  // namespace diastole
