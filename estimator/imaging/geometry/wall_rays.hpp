#pragma once
// Grey values along rays through a cine image, and the wall that a ray crosses.

#include <Eigen/Dense>
#include <optional>
#include <vector>

#include "estimator/imaging/geometry/cines.hpp"

namespace diastole::imaging {

inline constexpr double ray_step_mm = 0.25;  ///< a fraction of any pixel
inline constexpr double ray_mm = 70;         ///< farther than any ventricle's wall from its middle

/// An image with its values between the pixels: several places a pixel.
struct FineImage {
  Image grey;
  double row_spacing_mm, column_spacing_mm;
};
FineImage fine_image(const CineSlice& slice, const Eigen::ArrayXXd& image);

/// From a place of the image (in-plane mm) along a unit vector, a value each ray_step_mm up to ray_mm or the image's edge.
std::vector<double> profile_of(const FineImage& image, const Eigen::Vector2d& from_mm,
                               const Eigen::Vector2d& direction);

/// Where a profile falls through a level for the first time from a sample on, in mm; nothing if it does not.
std::optional<double> falls_through(const std::vector<double>& profile, double level, size_t from);

struct WallOnRay {
  double inner_mm, outer_mm;
};

/// From blood through a wall of 3 to 25 mm to its surroundings; nothing where the profile is another. Found by the slice's grey levels, its
/// edges then lie half way between those of this ray: by the slice's alone, coils would displace all contours towards their bright side.
std::optional<WallOnRay> wall_on_ray(const CineSlice& slice, const std::vector<double>& profile);

}  // namespace diastole::imaging
