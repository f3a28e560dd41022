#pragma once
// The two sections that reports show of a body before and after a motion: across the axis z at a height, and along it.

#include <functional>

#include "estimator/io/solution_file.hpp"
#include "estimator/solution/body_section.hpp"

namespace diastole {

/// Both go through `centre_mm` on the axis, whose height `height_words` says. `fields_at` gives what the cells show at
/// their centres: of each field as many values as points.
std::vector<SolutionSection> drawn_sections(
    const HermiteMesh& mesh, const NodeField& position_mm, const Eigen::Vector3d& centre_mm,
    const std::string& height_words,
    const std::function<std::vector<NamedField>(const std::vector<MaterialPoint>&)>& fields_at);

}  // namespace diastole
