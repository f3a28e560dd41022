#pragma once
// `diastole solve -o FILE ...`: the files a solution is written to, chosen by their endings.
//
//   .vtkhdf   Bezier hexahedra for ParaView (estimator/solution/solution_grid.hpp)
//   .csv      strain and stress at the Gauss points (estimator/solution/gauss_table.hpp)
//   .json     sections and profiles of the last frame for `diastole report` (estimator/io/solution_file.hpp)

#include <span>

#include "estimator/cli/output_files.hpp"
#include "estimator/io/study.hpp"
#include "estimator/solution/solution_grid.hpp"

namespace diastole {

/// Before the work. Throws InputError if a file has another ending, or may not be replaced.
void require_outputs(const OutputFiles& outputs, const Study& study);

void write_outputs(const OutputFiles& outputs, const Study& study, const ElasticModel& model,
                   std::span<const SolvedFrame> frames);

}  // namespace diastole
