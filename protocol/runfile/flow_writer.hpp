#pragma once
// Adds a measured volume to a run file that is there: /mr/flow/<segment>.

#include <filesystem>

#include "protocol/runfile/run.hpp"

namespace diastole::runfile {

/// The file is copied, changed and checked beside itself and then renamed, so that it is whole at every time. Throws InputError if the run has no such segment, holds
/// a volume of it already and it is not to be replaced, or if file or volume break a rule of `check`.
void store_flow(const std::filesystem::path& run, size_t segment, const FlowVolume& volume, bool replace);

}  // namespace diastole::runfile
