#pragma once
// The last frame's field in two cuts through the body, for the report.

#include "estimator/io/solution_file.hpp"
#include "estimator/reconstruction/coverage.hpp"

namespace diastole {

/// Across the axis at the body's middle height and along it; fields as reconstruction_record.hpp lists them.
std::vector<SolutionSection> field_sections(const HermiteMesh& mesh, const FrameField& field,
                                            const Coverage& coverage);

}  // namespace diastole
