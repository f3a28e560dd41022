#include "estimator/imaging/tracking/tags_file.hpp"

#include <fmt/format.h>

#include <iterator>

namespace diastole::imaging {

std::string tags_file_text(const std::vector<TrackedPoint>& points) {
  std::string text(tags_file_mark);
  text += ",own_mm,own_sigma_mm\n";
  for (const TrackedPoint& point : points) {
    fmt::format_to(std::back_inserter(text),
                   "{},{:.9f},{:.9f},{:.9f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f}\n", point.frame,
                   point.normal.x(), point.normal.y(), point.normal.z(), point.plane_mm, point.x_mm.x(),
                   point.x_mm.y(), point.x_mm.z(), point.sigma_mm, point.own_mm, point.own_sigma_mm);
  }
  return text;
}

}  // namespace diastole::imaging
