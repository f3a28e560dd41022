#pragma once
// A section through the body as two coloured drawings, undeformed and under load, on one scale and with one
// colour bar.
//
//   +-----------+   +-----------+  ▄ 10
//   | undeformed|   | under load|  █
//   |           |   | (grey line|  █ 5
//   +-----------+   |   before) |  █
//    |--20 mm--|    +-----------+  ▀ 0

#include <string>

#include "estimator/io/solution_file.hpp"
#include "estimator/report/page.hpp"

namespace diastole::report {

/// `bar`: what is shown, with its unit; `after`: title of the drawing under load.
std::string section_map(const SolutionSection& section, const NamedField& field, const std::string& bar,
                        const std::string& after);

/// What is drawn of all sections, where they have it.
struct MapChoice {
  const char* field;
  const char* bar;    ///< above the colour bar
  const char* words;  ///< in the captions
};
std::vector<Figure> section_maps(const std::vector<SolutionSection>& sections, const MapChoice& map,
                                 const std::string& after);

}  // namespace diastole::report
