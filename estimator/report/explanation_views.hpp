#pragma once
// The parts of an explanation's page that draw recordings and the wall.

#include "estimator/explain/verdict/explanation.hpp"
#include "estimator/report/page.hpp"

namespace diastole::report {

/// A table of all recordings; of the worst few traces, loops, residuals of the mean cycle, spectra and maps of the
/// residual by phase and cycle. Nothing if there are no traces.
void add_explained_traces(Page& page, const explain::Explanation& explanation);

/// Maps of the tags' or points' residuals. Nothing if there are none.
void add_explained_field(Page& page, const explain::Explanation& explanation);

}  // namespace diastole::report
