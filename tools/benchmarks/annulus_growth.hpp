#pragma once
// How this project's cost grows with the mesh: the 6 kPa gel annulus on ever more elements.

#include <filesystem>

#include "tools/benchmarks/annulus_solver.hpp"
#include "tools/benchmarks/figure_targets.hpp"

namespace diastole {

/// Prints a Markdown table and fitted exponents over meshes of at most `most_elements`, the time's beside its target of 1.5; draws time,
/// memory and fill into `figure` unless that is empty.
void measure_growth(const AnnulusSolver& own, size_t most_elements, const std::filesystem::path& figure,
                    const AnnulusWorkplace& place, FigureTargets& targets);

}  // namespace diastole
