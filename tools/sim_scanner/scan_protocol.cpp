#include "tools/sim_scanner/scan_protocol.hpp"

#include <fmt/format.h>

#include <cmath>

#include "protocol/contract/angle.hpp"

namespace diastole::scanner {

std::vector<ScanPlane> planes_of(const ScanProtocol& protocol) {
  const double pixel_mm = protocol.field_of_view_mm / protocol.matrix;
  const double half_mm = 0.5 * (protocol.matrix - 1) * pixel_mm;
  const auto plane = [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& along_row,
                         const Eigen::Vector3d& along_column, std::string view) {
    return ScanPlane{centre - half_mm * (along_row + along_column), along_row, along_column, std::move(view)};
  };
  std::vector<ScanPlane> planes;
  for (const double z_mm : protocol.short_axis_mm)
    planes.push_back(plane({0, 0, z_mm}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), "SA"));
  for (const double angle_deg : protocol.long_axis_deg) {
    const double angle = angle_deg * rad_per_deg;
    planes.push_back(plane({0, 0, protocol.middle_mm}, {std::cos(angle), std::sin(angle), 0},
                           -Eigen::Vector3d::UnitZ(), fmt::format("LA{:03.0f}", angle_deg)));
  }
  return planes;
}

}  // namespace diastole::scanner
