#include "estimator/imaging/flow/lumen_movement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace diastole::imaging {
namespace {

/// Around what moves: its wall and the still material at the wall.
constexpr int surroundings_px = 4;
/// The first round compares with the first phase, the second with the mean of what that has laid together, the third with a sharper mean.
constexpr int rounds = 3;
/// By which a later round may correct a place.
constexpr int correction_px = 2;
/// Gauss-Newton finds a place from this far: the edge is a pixel or more wide.
constexpr double least_movement_px = 0.5;
/// That a shift among all those tried makes a phase more alike by chance.
constexpr double chance = 1e-4;

using Shift = Eigen::Vector2i;

Shift whole(const Eigen::Vector2d& shift) {
  return {static_cast<int>(std::lround(shift.x())), static_cast<int>(std::lround(shift.y()))};
}

/// The pixel that lies there, or the image's nearest to it.
float value_at(const Image& image, Eigen::Index column, Eigen::Index row) {
  return image(std::clamp<Eigen::Index>(row, 0, image.rows() - 1),
               std::clamp<Eigen::Index>(column, 0, image.cols() - 1));
}

/// A rectangle around a region.
class Window {
 public:
  explicit Window(const MovingRegion& region) : first_(region.pixels[0]), last_(first_) {
    for (const Eigen::Vector2i& at : region.pixels) {
      first_ = first_.cwiseMin(at);
      last_ = last_.cwiseMax(at);
    }
    // Each phase's lumen is a part of the region: it goes no further than from one end of it to the other.
    reach_ = (last_ - first_).maxCoeff() / 2 + 1;
    first_.array() -= surroundings_px;
    last_.array() += surroundings_px;
  }

  [[nodiscard]] int reach() const { return reach_; }
  [[nodiscard]] Image of(const Image& image, const Shift& shift) const {
    Image part(last_.y() - first_.y() + 1, last_.x() - first_.x() + 1);
    for (Eigen::Index column = 0; column < part.cols(); ++column)
      for (Eigen::Index row = 0; row < part.rows(); ++row)
        part(row, column) = value_at(image, first_.x() + shift.x() + column, first_.y() + shift.y() + row);
    return part;
  }

 private:
  Eigen::Vector2i first_, last_;
  int reach_ = 0;
};

double unlikeness(const Image& pattern, const Image& image, const Window& window, const Shift& shift) {
  return static_cast<double>((window.of(image, shift) - pattern).square().sum());
}

/// Where a parabola through three values a step apart is least, in steps from the middle one, which is the least of them.
double least_of(double before, double middle, double after) {
  const double bend = before - 2 * middle + after;
  return bend > 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0.0;
}

Eigen::Vector2d likeliest_shift(const Image& pattern, const Image& image, const Window& window,
                                const Shift& about, int reach) {
  Shift best = about;
  double least = std::numeric_limits<double>::infinity();
  for (int x = -reach; x <= reach; ++x) {
    for (int y = -reach; y <= reach; ++y) {
      const Shift shift = about + Shift(x, y);
      const double here = unlikeness(pattern, image, window, shift);
      if (here >= least) continue;
      least = here;
      best = shift;
    }
  }
  Eigen::Vector2d place = best.cast<double>();
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    const Shift step = Shift::Unit(axis);
    place[axis] += least_of(unlikeness(pattern, image, window, best - step), least,
                            unlikeness(pattern, image, window, best + step));
  }
  return place;
}

Image mean_within(const std::vector<Image>& images, const Window& window,
                  const std::vector<Eigen::Vector2d>& places) {
  Image sum = window.of(images[0], whole(places[0]));
  for (size_t k = 1; k < images.size(); ++k)
    sum += window.of(images[k], whole(places[k]));
  return sum / static_cast<float>(images.size());
}

double unlikeness_of_all(const std::vector<Image>& images, const Window& window,
                         const std::vector<Eigen::Vector2d>& places) {
  const Image mean = mean_within(images, window, places);
  double sum = 0;
  for (size_t k = 0; k < images.size(); ++k)
    sum += unlikeness(mean, images[k], window, whole(places[k]));
  return sum;
}

}  // namespace

std::vector<Eigen::Vector2d> lumen_movement_px(const std::vector<Image>& magnitude,
                                               const MovingRegion& region, double noise) {
  const Window window(region);
  const std::vector<Eigen::Vector2d> rest(magnitude.size(), Eigen::Vector2d::Zero());
  std::vector<Eigen::Vector2d> places = rest;
  Image pattern = window.of(magnitude[0], Shift::Zero());
  for (int round = 0; round < rounds; ++round) {
    for (size_t k = 0; k < magnitude.size(); ++k)
      places[k] = likeliest_shift(pattern, magnitude[k], window, whole(places[k]),
                                  round == 0 ? window.reach() : correction_px);
    pattern = mean_within(magnitude, window, places);
  }
  const auto count = static_cast<double>(magnitude.size());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& place : places)
    mean += place / count;
  double squares = 0;
  for (Eigen::Vector2d& place : places) {
    place -= mean;
    squares += place.squaredNorm() / count;
  }
  if (std::sqrt(squares) < least_movement_px) return {};
  // Of so many shifts the best lowers chi-square by twice the logarithm of their number.
  const double tried = std::pow(2 * window.reach() + 1, 2);
  const double by_chance = 2 * std::log(tried / chance) * count * noise * noise;
  if (unlikeness_of_all(magnitude, window, rest) - unlikeness_of_all(magnitude, window, places) < by_chance)
    return {};
  return places;
}

std::vector<Image> held_still(const std::vector<Image>& images,
                              const std::vector<Eigen::Vector2d>& movement_px) {
  std::vector<Image> still = images;
  for (size_t k = 0; k < images.size(); ++k) {
    const Shift shift = whole(movement_px[k]);
    for (Eigen::Index column = 0; column < images[k].cols(); ++column)
      for (Eigen::Index row = 0; row < images[k].rows(); ++row)
        still[k](row, column) = value_at(images[k], column + shift.x(), row + shift.y());
  }
  return still;
}

}  // namespace diastole::imaging
