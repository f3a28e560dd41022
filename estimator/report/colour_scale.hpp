#pragma once
// The colours of maps, and cells painted in them: viridis, even to the eye and safe for the colour-blind.

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace diastole::report {

/// viridis (S. van der Walt, N. Smith, 2015, CC0) at 0..1, as "#rrggbb".
std::string map_colour(double fraction);

/// From the 2nd to the 98th hundredth of the values, so that a singular corner does not take all colours.
/// Never empty.
std::array<double, 2> colour_range(const std::vector<double>& values);

/// blue - white - red at 0..1, for signed values.
std::string signed_colour(double fraction);

/// Values in colours, in so many steps that neighbours look alike.
struct ColourScale {
  std::array<double, 2> range;
  std::string (*colour)(double fraction) = map_colour;
  size_t steps = 48;

  /// 0 to 1; values beyond the range are at its ends.
  [[nodiscard]] double fraction_of(double value) const;
  [[nodiscard]] std::string colour_of_step(size_t step) const;
};

/// Cells of one colour become one path; values that are not finite leave a hole.
class CellPainter {
 public:
  explicit CellPainter(const ColourScale& scale) : scale_(scale), paths_(scale.steps) {}

  /// `outline`: the cell as commands of an SVG path.
  void add(double value, std::string_view outline);
  /// A stroke of the cells' own colour closes the hairlines between neighbours.
  [[nodiscard]] std::string svg(double stroke) const;

 private:
  const ColourScale& scale_;
  std::vector<std::string> paths_;
};

/// Where a colour bar stands, in viewBox units: its left edge, its ends, and room for the numbers on its right.
struct ColourBarPlace {
  double left, top, height;
  double width = 14, room = 62;
};

/// The bar with its ticks; `label` stands above.
std::string colour_bar(const ColourScale& scale, const std::string& label, const ColourBarPlace& place);

}  // namespace diastole::report
