#include "estimator/imaging/tracking/ghost.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace diastole::imaging {
namespace {

/// Among some hundred shifts the largest of pure noise is 3 to 4; what an edge leaks into air passes now and then, and is as small as it is.
constexpr double least_score = 6.0;
/// What is brighter is no air with a ghost but another picture.
constexpr double dark_in_sigmas = 6.0;
/// An edge leaks over some pixels.
constexpr double inside_in_pixels = 3.0;
constexpr Eigen::Index least_shift = 8;
constexpr size_t most_ghosts = 4;
/// Pixels of air, evenly over slice and phases: a ghost of a fiftieth in noise of a twentieth stands out of them by 14 standard errors.
constexpr size_t enough_air = 30000;

struct AirPixel {
  size_t phase;
  Eigen::Index row, column;
  double square;  // over the noise's, what known ghosts explain taken off
};

struct Sums {
  double count = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  void add(double a, double b) {
    count += 1;
    x += a;
    y += b;
    xx += a * a;
    xy += a * b;
    yy += b * b;
  }
};

}  // namespace

std::vector<Ghost> find_ghosts(const TagView& view, const std::vector<const MaterialMap*>& maps,
                               const std::vector<double>& noise) {
  std::vector<AirPixel> air;
  for (size_t k = 0; k < view.images.size(); ++k) {
    const PixelMask is_air = deep_inside(*maps[k], Material::nothing,
                                         inside_in_pixels * view.plane.finer_spacing_mm(), view.plane);
    for (Eigen::Index column = 0; column < is_air.cols(); ++column) {
      for (Eigen::Index row = 0; row < is_air.rows(); ++row) {
        const double value = static_cast<double>(view.images[k](row, column)) / noise[k];
        if (!is_air(row, column) || value > dark_in_sigmas || view.is_masked(k, row, column)) continue;
        air.push_back({k, row, column, value * value});
      }
    }
  }
  const size_t stride = air.size() / enough_air + 1;
  for (size_t i = 0; i * stride < air.size(); ++i)
    air[i] = air[i * stride];
  air.resize((air.size() + stride - 1) / stride);
  std::vector<Ghost> ghosts;
  while (air.size() > 200 && ghosts.size() < most_ghosts) {
    std::optional<Ghost> best;
    double highest = least_score;
    for (const bool down : {false, true}) {
      const Eigen::Index extent = down ? view.images[0].rows() : view.images[0].cols();
      for (Eigen::Index shift = least_shift; shift <= extent - least_shift; ++shift) {
        const Ghost whole{.down = down, .shift = shift, .share = 1.0};
        Sums sums;
        for (const AirPixel& pixel : air) {
          const double over =
              whole.over(view.images[pixel.phase], pixel.row, pixel.column) / noise[pixel.phase];
          sums.add(over * over, pixel.square);
        }
        const double xx = sums.xx - sums.x * sums.x / sums.count;
        const double xy = sums.xy - sums.x * sums.y / sums.count;
        const double yy = sums.yy - sums.y * sums.y / sums.count;
        if (xx <= 0 || xy <= 0) continue;
        const double slope = xy / xx;
        const double score = slope / std::sqrt(std::max(yy - slope * xy, 1e-300) / (sums.count - 2) / xx);
        if (score <= highest) continue;
        highest = score;
        best = Ghost{.down = down, .shift = shift, .share = std::sqrt(slope)};
      }
    }
    if (!best) break;
    for (AirPixel& pixel : air) {
      const double over = best->over(view.images[pixel.phase], pixel.row, pixel.column) / noise[pixel.phase];
      pixel.square -= over * over;
    }
    ghosts.push_back(*best);
  }
  return ghosts;
}

}  // namespace diastole::imaging
