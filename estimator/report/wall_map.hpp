#pragma once
// The values of a wall's elements on the wall unrolled: cut along the first element's left side and laid flat.
//
//     top    +-----+-----+ - - +-----+   one drawing a layer through the wall, the inner one first;
//            | 8.6 | 8.7 |     | 8.5 |   across: the angle around the axis, 0 to 360°
//     bottom +-----+-----+ - - +-----+

#include <array>
#include <string>
#include <vector>

namespace diastole::report {

/// `values` in the order of the elements: around, then along, then through the wall; `elements` counts them so. One that
/// is no number is left grey. `label` stands above the colour bar.
std::string wall_map(const std::array<size_t, 3>& elements, const std::vector<double>& values,
                     const std::string& label);

}  // namespace diastole::report
