#pragma once
// The catheter's test as a page: each step with its fit, what the fit leaves, amplitude and lag over frequency.

#include <string>

#include "estimator/catheter/step_fit.hpp"
#include "protocol/runfile/run.hpp"

namespace diastole {

/// Precondition: the response has no refusal, and came from this channel of the run.
std::string catheter_page(const runfile::RecordedRun& run, const std::string& channel,
                          const signal::CatheterResponse& response);

}  // namespace diastole
