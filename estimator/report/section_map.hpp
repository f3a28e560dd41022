#pragma once
// A section through the body as two coloured drawings, undeformed and under load, on one scale and with one
// colour bar.
//
//   +-----------+   +-----------+  ▄ 10
//   | undeformed|   | under load|  █
//   |           |   | (grey line|  █ 5      colours: viridis, even to the eye and safe for the colour-blind
//   +-----------+   |   before) |  █
//    |--20 mm--|    +-----------+  ▀ 0

#include <array>
#include <string>
#include <vector>

#include "estimator/io/solution_file.hpp"

namespace diastole::report {

/// viridis (S. van der Walt, N. Smith, 2015, CC0) at 0..1, as "#rrggbb".
std::string map_colour(double fraction);

/// From the 2nd to the 98th hundredth of the values, so that a singular corner does not take all colours.
/// Never empty.
std::array<double, 2> colour_range(const std::vector<double>& values);

struct SectionMapLabels {
  std::string bar;    ///< what is shown, with its unit
  std::string after;  ///< title of the drawing under load
};

std::string section_map(const SolutionSection& section, const NamedField& field,
                        const SectionMapLabels& labels);

}  // namespace diastole::report
