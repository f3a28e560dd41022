#pragma once
// Gated imaging of the simulated rig: the cavity's true volume (tools/sim_rig/volume_trace.hpp), averaged over a run's cycles in
// phases from the trigger, with noise, as /mr/flow of the run file.

#include <cstdint>
#include <filesystem>
#include <string>

namespace diastole {

struct GatedNoise {
  double sd_mL = 0.0;  ///< of each phase, independent
  uint64_t seed = 1;
};

/// Adds the volume of the run's first segment that moves, its first cycles left out as dummies. `triggers_before`: of the rig's
/// earlier runs. Returns a remark if nothing could be added, as to fewer than six cycles. Throws InputError if the run cannot be
/// written.
[[nodiscard]] std::string store_gated_volume(const std::string& run, const std::filesystem::path& trace,
                                             size_t triggers_before, const GatedNoise& noise);

}  // namespace diastole
