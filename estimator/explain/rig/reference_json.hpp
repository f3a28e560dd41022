#pragma once
// rig.reference.json: what `diastole reference` learnt of a rig, so that explanations need not learn it again.

#include <string>
#include <string_view>

#include "estimator/explain/rig/reference.hpp"

namespace diastole::explain {

/// Also the key `channels` of contracts, for people: RMS and part of the range by channel.
std::string to_json(const Reference& reference);
/// Throws InputError with file, key, value and remedy if the text is no reference.
Reference reference_from_json(std::string_view text, const std::string& file);

}  // namespace diastole::explain
