#pragma once

#include <filesystem>

namespace diastole {

/// The user's folder for what may be deleted at any time (cache.hpp): XDG_CACHE_HOME/diastole, or ~/.cache/diastole; it need not exist.
/// Empty if there is none.
std::filesystem::path cache_folder();

}  // namespace diastole
