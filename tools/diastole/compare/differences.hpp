#pragma once
// What was known and set otherwise in some of the runs: facts of the session, the protocol (segments, the points of uploaded
// waveforms, triggers, slices, and what the experiment file states besides), the rig and its calibration.

#include <vector>

#include "protocol/runfile/reader.hpp"
#include "protocol/runfile/session.hpp"
#include "tools/diastole/compare/comparison.hpp"

namespace diastole::comparison {

/// `sessions` of the same runs, in their order.
void add_differences(Comparison& comparison, const std::vector<runfile::RunFile>& runs,
                     const std::vector<runfile::Session>& sessions);

}  // namespace diastole::comparison
