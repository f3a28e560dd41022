#pragma once
// A scanner in a box: DICOM of a moving body. Its physics is its own; how images are read and tags are followed it does not know.
//
//   Body motion of each phase -> slice_image.hpp (signal, spectrum, noise) -> dicom_image.hpp

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"
#include "tools/sim_scanner/scan_protocol.hpp"

namespace diastole::scanner {

/// x_patient = origin + axes X.
struct ScanPose {
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
};

struct MovingBody {
  const HermiteMesh* mesh;
  std::vector<double> times_s;         ///< of each phase, since the tags were made
  std::vector<NodeField> position_mm;  ///< of each phase
  double period_s;
};

struct ScannedSeries {
  int number;
  std::string kind;  ///< "tagged cine", "cine"
  std::string view;
  std::vector<double> angles_deg;  ///< of the tags
  size_t files;
};

/// Writes NAME/sNN_iNNNN.dcm for all slices, directions and phases into the folder, which must exist. `progress` hears of every image.
std::vector<ScannedSeries> scan(const MovingBody& body, const ScanProtocol& protocol, const ScanPose& pose,
                                const std::filesystem::path& folder,
                                const std::function<void(size_t done, size_t all)>& progress);

}  // namespace diastole::scanner
