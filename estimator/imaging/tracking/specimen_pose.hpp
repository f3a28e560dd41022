#pragma once
// Where the specimen's frame lies in the scanner: for an annulus axis z and mid-height 0, for a ventricle as its mesh has it.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "estimator/imaging/tracking/track_slices.hpp"

namespace diastole::imaging {

/// x_patient = origin + axes * x_specimen.
struct SpecimenPose {
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes =
      Eigen::Matrix3d::Identity();  ///< columns: the specimen's x, y, z in patient coordinates
  std::string source;

  [[nodiscard]] TrackedPoint to_specimen(const TrackedPoint& patient) const;
};

/// Keys origin_mm, x_axis, y_axis, z_axis and, for the reader, kind. Throws InputError (file, line, remedy) unless the axes are
/// orthogonal, of length 1 and right-handed, to a thousandth.
SpecimenPose read_pose(const std::filesystem::path& file);
std::string pose_text(const SpecimenPose& pose, const std::string& kind);

/// The outlines of an annulus, in mm: medians over slices and phases.
struct AnnulusOutline {
  double inner_radius_mm;  ///< in the first phase
  double outer_radius_mm;
  double height_mm;
};

struct FoundPose {
  std::optional<SpecimenPose> pose;
  std::optional<AnnulusOutline> outline;  ///< where there is a pose
  std::string missing;                    ///< why there is none
  std::string remedy;                     ///< what to give, then
};

/// An annulus's pose from its outlines: the axis along the normal of slices that show a ring, through the middle of its circles, which do
/// not move as it inflates; mid-height where a person gave a ring's height over it (TagView::height_mm), or else between the ends that
/// slices along the axis show. A turn about the axis changes nothing of an
/// annulus: x points as near to patient x (or y) as it can.
FoundPose find_annulus_pose(const std::vector<TrackedSlice>& slices);

}  // namespace diastole::imaging
