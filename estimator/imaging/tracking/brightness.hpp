#pragma once
// How bright a material is at each place of an image, and how strongly its tags modulate it: smooth fields that are fitted
// beside the motion. In a window about each place the image is  sum_j amplitude_j(x) pattern_j(x)  with patterns such as
// 1, cos phi, cos 2 phi.

#include <Eigen/Dense>
#include <array>
#include <span>
#include <vector>

namespace diastole::imaging {

/// Brightness varies over a tag spacing, not within it: there it is the tags' own.
inline constexpr double window_in_spacings = 1.0;

/// Amplitudes on the nodes of a coarse grid, by least squares in Gaussian windows; between nodes bilinear. Where a window holds
/// little, the slice's own average takes over.
class Brightness {
 public:
  /// The coarse grid over a slice of this extent; windows have the standard deviation `window_mm`, nodes half of it between them.
  Brightness(const Eigen::Vector2d& extent_mm, double window_mm, int patterns);

  /// One pixel: `patterns` of the given length, its weight and value.
  void add(const Eigen::Vector2d& x_mm, std::span<const double> patterns, double weight, double value);
  /// After the last pixel: amplitudes everywhere, or only for places that were added.
  enum class Places { all, added };
  void solve(Places places);
  /// The amplitudes at a place that was solved for, written to `amplitudes`.
  void at(const Eigen::Vector2d& x_mm, std::span<double> amplitudes) const;
  /// The picture there, sum_j amplitude_j pattern_j; its amplitudes are written to the first of `amplitudes`.
  double picture(const Eigen::Vector2d& x_mm, std::span<const double> patterns,
                 std::span<double> amplitudes) const;

 private:
  struct Corner {
    std::array<Eigen::Index, 4> node;
    std::array<double, 4> share;
  };
  [[nodiscard]] Corner corner(const Eigen::Vector2d& x_mm) const;
  template <int Count>
  void add_pixel(const Eigen::Vector2d& x_mm, const double* patterns, double weight, double value);
  template <int Count>
  void solve_nodes(Places places);

  int patterns_;
  double node_mm_;
  Eigen::Index columns_;
  Eigen::Index rows_;
  Eigen::ArrayXXd moments_;     // products and right sides x nodes
  std::vector<bool> is_added_;  // a node
  Eigen::ArrayXXd amplitudes_;  // patterns x nodes
};

}  // namespace diastole::imaging
