#pragma once
// How slices lie to each other and to the tags, in patient coordinates and in words.

#include <string>

#include "estimator/imaging/series/image_folder.hpp"

namespace diastole::imaging {

/// Unit normal of the tag planes, which are orthogonal to the slice: the stripes' direction of change within it.
Eigen::Vector3d tag_normal(const SlicePlane& plane, const TagWave& tag);

/// "short axis (transverse)", "long axis, 30 degrees (coronal, tilted 3 degrees)", or the anatomical plane alone where all slices are
/// parallel. The angle is measured about the axis from the short axis's rows.
std::string view_in_words(const ImageFolder& folder, const ImageSeries& series);

}  // namespace diastole::imaging
