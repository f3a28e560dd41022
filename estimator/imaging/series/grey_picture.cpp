#include "estimator/imaging/series/grey_picture.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "estimator/io/tracking_file.hpp"
#include "protocol/signal/quantile.hpp"

namespace diastole::imaging {

float white_of(std::span<const Image> images) {
  constexpr double white_share = 0.995;
  constexpr float least = 1e-6F;
  std::vector<float> values;
  for (const Image& image : images)
    values.insert(values.end(), image.data(), image.data() + image.size());
  return std::max(signal::quantile(std::move(values), white_share), least);
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
