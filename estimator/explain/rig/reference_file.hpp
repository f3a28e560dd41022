#pragma once
// rig.reference.json: what `diastole reference` learnt of a rig, so that explanations need not learn it again.

#include <functional>
#include <string>

#include "estimator/explain/rig/reference.hpp"
#include "estimator/io/study.hpp"

namespace diastole::explain {

/// Also the key `channels` of contracts, for people: RMS and part of the range by channel.
std::string to_json(const Reference& reference);
/// Throws InputError with file, key, problem and remedy if the text is no reference.
Reference reference_from_json(std::string_view text, const std::string& file);

/// What a study's `[data] reference` says: studies, or one file that `diastole reference` wrote. What studies teach is kept in
/// the user's cache (XDG_CACHE_HOME) and learnt again once a file of theirs changes. Throws InputError.
Reference reference_of(const Study& study, size_t threads,
                       const std::function<void(std::string_view)>& progress = {});

}  // namespace diastole::explain
