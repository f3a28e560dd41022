#pragma once
// The brightness of tagged tissue as a function of its tags' phases: a constant and cosines about the dark lines. One direction has a second
// harmonic (binomial trains, and magnitude images that fold at zero); a grid has the product of its two.

#include <array>
#include <cmath>
#include <span>

namespace diastole::imaging {

struct TagPatterns {
  static constexpr size_t most = 4;
  std::array<double, most> value{};
  size_t count = 0;

  [[nodiscard]] std::span<const double> values() const { return {value.data(), count}; }
};

class TagModel {
 public:
  explicit TagModel(size_t directions) : directions_(directions) {}

  [[nodiscard]] size_t directions() const { return directions_; }
  [[nodiscard]] size_t patterns() const { return directions_ == 1 ? 3 : 4; }

  /// `phases_rad`: one a direction.
  [[nodiscard]] TagPatterns at(std::span<const double> phases_rad) const {
    const double first = std::cos(phases_rad[0]);
    if (directions_ == 1) return {{1.0, first, 2 * first * first - 1}, 3};
    const double second = std::cos(phases_rad[1]);
    return {{1.0, first, second, first * second}, 4};
  }
  /// The brightness's derivative by the phase of one direction; `patterns` at these phases.
  [[nodiscard]] double slope(std::span<const double> phases_rad, const TagPatterns& patterns,
                             std::span<const double> amplitudes, size_t direction) const {
    const double sine = std::sin(phases_rad[direction]);
    if (directions_ == 1) return -sine * (amplitudes[1] + 4 * amplitudes[2] * patterns.value[1]);
    return -sine * (amplitudes[1 + direction] + amplitudes[3] * patterns.value[2 - direction]);
  }
  /// How deep the stripes of a direction are: half the difference of bright and dark.
  [[nodiscard]] double depth(std::span<const double> amplitudes, size_t direction) const {
    return -amplitudes[1 + direction];
  }

 private:
  size_t directions_;
};

}  // namespace diastole::imaging
