#pragma once
// The reference that a study names, read, or learnt once and kept.

#include <functional>
#include <string_view>

#include "estimator/explain/rig/reference.hpp"
#include "estimator/io/study.hpp"

namespace diastole::explain {

/// What a study's `[data] reference` says: studies, or one file that `diastole reference` wrote. What studies teach is kept in
/// the user's cache (XDG_CACHE_HOME) and learnt again once a file of theirs changes. Throws InputError.
Reference reference_of(const Study& study, size_t threads,
                       const std::function<void(std::string_view)>& progress = {});

}  // namespace diastole::explain
