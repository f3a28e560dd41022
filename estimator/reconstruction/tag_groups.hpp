#pragma once
// Tag points by where they come from: families share a tag direction, slices share an image plane as well.
//
// The file does not name images, but a stripe is seen in the plane of its image, whose normal m is perpendicular to
// the tag's normal. In a family, m·x takes few values, exactly: one for each image. m is looked for among the
// products of the families' normals (an image shows two families), and the values are clusters along m.

#include <Eigen/Dense>
#include <span>
#include <string>
#include <vector>

#include "estimator/io/measurement.hpp"

namespace diastole {

struct TagFamily {
  Eigen::Vector3d normal;
  std::vector<size_t> tags;
};

struct TagSlice {
  size_t family = 0;
  Eigen::Vector3d image_normal;  ///< zero where no image plane was found: the slice is then the whole family
  double position_mm = 0.0;      ///< m·x
  std::vector<size_t> tags;
};

struct TagGroups {
  std::vector<TagFamily> families;  ///< of at least `least_family` points
  std::vector<TagSlice> slices;
};

inline constexpr size_t least_family = 20;

TagGroups group_tags(std::span<const TagPoint> tags);

/// "(0.71, 0.71, 0)".
std::string direction_words(const Eigen::Vector3d& direction);
/// "tags along (0.71, 0.71, 0) in the image at 0.0 mm along (0, 0, 1)".
std::string slice_words(const TagGroups& groups, const TagSlice& slice);

}  // namespace diastole
