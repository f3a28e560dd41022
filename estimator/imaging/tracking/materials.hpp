#pragma once
// Which pixels are tissue, in each phase: distinguished from still water, from water that mixes and from nothing by how tags fade and
// how bright each of them is.

#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "estimator/imaging/tracking/tag_model.hpp"
#include "estimator/imaging/tracking/tag_view.hpp"

namespace diastole::imaging {

enum class Material : uint8_t { nothing, tissue, still_water, mixed_water };
using MaterialMap = Eigen::Array<Material, Eigen::Dynamic, Eigen::Dynamic>;

/// A map for the whole cycle. Tags fade with a material's T1 (0.3 to 1.5 s in tissue and gel, 2 s and more in still water), and at once
/// in water that mixes: signal is sorted by the fading of its modulation into three groups. Boundaries are good to half a tag
/// spacing and to the motion of the cycle.
MaterialMap first_materials(const TagView& view);

/// A value of each pattern at every pixel.
using PatternMaps = std::vector<Eigen::ArrayXXd>;

/// Patterns of tags that do not move.
struct RestPatterns {
  RestPatterns(const TagView& view, const std::vector<TagWave>& waves);

  PatternMaps fixed;  ///< TagModel's, at the phases that the tags were made with
  PatternMaps free;   ///< of any phase: 1, and cosine and sine of each direction
};

/// The map of image k, from that of a phase nearby: each pixel goes to the material whose picture, fitted in smooth windows
/// and carried across the boundary, explains it and its neighbours best. `depth_before_mm`: of tissue in `before`; `tissue`: TagModel's patterns
/// at the phases tracked so far. Masked pixels stay what they were before.
MaterialMap refined_materials(size_t k, const TagView& view, const MaterialMap& before,
                              const Eigen::ArrayXXf& depth_before_mm, const PatternMaps& tissue,
                              const RestPatterns& rest);

/// Tissue is what lies within a drawn outer contour and outside a drawn inner one. Of one contour alone the other edge stays as it
/// was found: an outer one leaves the cavity (water that mixes), an inner one the outside.
void draw_contours(const PhaseEdits& edits, MaterialMap& map);

/// Distance in mm from each pixel's centre to the edge of the material, which lies half a pixel before the nearest centre that is
/// not of it; negative outside. The image's border is no edge of it.
Eigen::ArrayXXf depth_mm(const MaterialMap& map, Material material, const SlicePlane& plane);

/// The pixels whose `depth_mm` is at least this positive one.
PixelMask deep_inside(const MaterialMap& map, Material material, double least_mm, const SlicePlane& plane);

/// Pieces of tissue smaller than this or than a tenth of the largest, and holes in it, are noise: a wall is one piece, or two of a like
/// size where a slice cuts it along its axis.
void remove_specks(MaterialMap& map, const SlicePlane& plane, double least_mm2);

}  // namespace diastole::imaging
