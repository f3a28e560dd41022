#include "estimator/imaging/series/grey_picture.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "estimator/io/tracking_file.hpp"

namespace diastole::imaging {

float white_of(std::span<const Image> images) {
  constexpr double white_share = 0.995, least = 1e-6;
  std::vector<float> values;
  for (const Image& image : images)
    values.insert(values.end(), image.data(), image.data() + image.size());
  if (values.empty()) return static_cast<float>(least);
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(white_share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return std::max(*at, static_cast<float>(least));
}

std::string grey_picture(const Image& image, float white) {
  std::string bytes;
  bytes.reserve(static_cast<size_t>(image.size()));
  for (Eigen::Index row = 0; row < image.rows(); ++row) {
    for (Eigen::Index column = 0; column < image.cols(); ++column)
      bytes += static_cast<char>(
          static_cast<unsigned char>(std::lround(255 * std::clamp(image(row, column) / white, 0.0F, 1.0F))));
  }
  return base64(bytes);
}

}  // namespace diastole::imaging
