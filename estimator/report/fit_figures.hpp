#pragma once
// Pictures of what a fit finds of its parameters, and of a Monte Carlo table.

#include <vector>

#include "estimator/io/fit_file.hpp"
#include "estimator/montecarlo/cells_file.hpp"
#include "estimator/report/page.hpp"

namespace diastole::report {

/// Values and standard errors of a regional parameter: on the unrolled wall where the specimen has one, else over the
/// elements' numbers.
std::vector<Figure> regional_figures(const FitRecord& fit, const FittedParameter& parameter);

/// The profile likelihood, with the parabola that the standard error stands for. Precondition: it has one.
Figure profile_figure(const FittedParameter& parameter);

/// One parameter's spread over the noise, a line for each number of frames; the paper's cells as dots where the table
/// holds them.
Figure table_figure(const SavedTable& table, size_t parameter);

}  // namespace diastole::report
