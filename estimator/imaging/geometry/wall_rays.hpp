#pragma once
// Grey values along rays through a cine image, and the wall that a ray crosses.

#include <Eigen/Dense>
#include <optional>
#include <vector>

#include "estimator/imaging/geometry/cines.hpp"

namespace diastole::imaging {

inline constexpr double ray_step_mm = 0.25;  ///< a fraction of any pixel
inline constexpr double ray_mm = 70;         ///< farther than any ventricle's wall from its middle

/// An image with its values between the pixels: rows x columns of places so far apart, the first of them the first pixel.
struct FineImage {
  Image grey;
  double row_spacing_mm, column_spacing_mm;
};
FineImage fine_image(const CineSlice& slice, const Eigen::ArrayXXd& image);

/// How far from an edge the image is not yet what lies there: farther away an edge whose spectrum ends with the pixels' own is off by less than
/// a twentieth of its height.
double edge_blur_mm(const SlicePlane& plane);

/// From a place of the image (in-plane mm) along a unit vector, a value each ray_step_mm up to ray_mm or the image's edge.
std::vector<double> profile_of(const FineImage& image, const Eigen::Vector2d& from_mm,
                               const Eigen::Vector2d& direction);

struct WallOnRay {
  double inner_mm, outer_mm;
};

/// From blood through a wall of 3 to 25 mm to its surroundings; nothing where the profile is another. Found by the slice's grey levels, its
/// edges then lie half way between those of this ray: by the slice's alone, coils would displace all contours towards their bright side.
std::optional<WallOnRay> wall_on_ray(const CineSlice& slice, const std::vector<double>& profile);

/// Where the wall ends that a profile begins in, in mm and by the slice's levels; nothing where it does not.
std::optional<double> end_of_wall(const CineSlice& slice, const std::vector<double>& profile);

}  // namespace diastole::imaging
