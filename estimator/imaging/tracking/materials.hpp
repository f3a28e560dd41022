#pragma once
// Which pixels are tissue, in each phase: told from still water, from water that mixes and from nothing by how tags fade and how bright
// each of them is.

#include <Eigen/Dense>
#include <cstdint>
#include <functional>
#include <span>
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

/// The phases of the tags at a pixel, one a direction, as tracked so far.
using PhasesAt = std::function<void(Eigen::Index row, Eigen::Index column, std::span<double> phases_rad)>;

/// The map of image k, from that of a phase nearby: each pixel goes to the material whose picture, fitted in smooth windows
/// and carried across the boundary, explains it and its neighbours best. `tissue` are the tracked phases, `still` those of the tags at rest.
/// Masked pixels stay what they were before.
MaterialMap refined_materials(size_t k, const TagView& view, const MaterialMap& before,
                              const PhasesAt& tissue, const PhasesAt& still);

/// Tissue is what lies within a drawn outer contour and outside a drawn inner one. Of one contour alone the other edge stays as it
/// was found: an outer one leaves the cavity (water that mixes), an inner one the outside.
void draw_contours(const PhaseEdits& edits, MaterialMap& map);

/// Distance in mm from each pixel's centre to the edge of the material, which lies half a pixel before the nearest centre that is
/// not of it; negative outside. The image's border is no edge of it.
Eigen::ArrayXXf depth_mm(const MaterialMap& map, Material material, const SlicePlane& plane);

/// Pieces of tissue smaller than this or than a tenth of the largest, and holes in it, are noise: a wall is one piece, or two of a like
/// size where a slice cuts it along its axis.
void remove_specks(MaterialMap& map, const SlicePlane& plane, double least_mm2);

}  // namespace diastole::imaging
