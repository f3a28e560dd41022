#pragma once
// A unix stream socket on which somebody listens.

#include <filesystem>

namespace diastole::sim_rig {

/// A non-blocking listening socket at `path`; a stale socket there is replaced. `option` is named in the remedy. Throws
/// HardwareError.
int listen_at(const std::filesystem::path& path, const char* option);

}  // namespace diastole::sim_rig
