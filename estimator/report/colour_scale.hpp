#pragma once
// The colours of maps: viridis, even to the eye and safe for the colour-blind.

#include <array>
#include <string>
#include <vector>

namespace diastole::report {

/// viridis (S. van der Walt, N. Smith, 2015, CC0) at 0..1, as "#rrggbb".
std::string map_colour(double fraction);

/// From the 2nd to the 98th hundredth of the values, so that a singular corner does not take all colours.
/// Never empty.
std::array<double, 2> colour_range(const std::vector<double>& values);

/// How many colours a map is drawn in.
inline constexpr size_t map_colours = 48;

/// Where a colour bar stands, in viewBox units: its left edge, its ends, and room for the numbers on its right.
struct ColourBarPlace {
  double left, top, height;
  double width = 14, room = 62;
};

/// The bar with its ticks; `label` stands above.
std::string colour_bar(const std::array<double, 2>& range, const std::string& label,
                       const ColourBarPlace& place);

}  // namespace diastole::report
