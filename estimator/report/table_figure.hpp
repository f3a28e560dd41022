#pragma once
// A Monte Carlo table as pictures.

#include "estimator/montecarlo/cells_file.hpp"
#include "estimator/report/page.hpp"

namespace diastole::report {

/// One parameter's spread over the noise, a line for each number of frames; the paper's cells as dots where the table
/// holds them.
Figure table_figure(const SavedTable& table, size_t parameter);

/// Whether the paper's Table 1 is of these parameters.
bool is_papers_law(const SavedTable& table);

}  // namespace diastole::report
