#pragma once
// An explanation as a JSON document: docs/explain.md shows one.
//
// The keys are the struct's members, but for an effect's parameters: an object, name -> {value, standard_error, ci90}.
// What is not there (a segment, a phase, a band, a region, a next experiment) is null, and so is a number that is not
// finite. Traces are rounded to 1e-5 of their units. Reading takes a missing key as its default, so that a document
// with no more than verdict, effects, where and gap can be read too; it refuses unknown verdicts and values of a wrong kind.

#include <string>
#include <string_view>

#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::explain {

inline constexpr std::string_view explanation_file_mark = "diastole-explanation";

std::string to_json(const Explanation& explanation);

/// Whether a JSON text is an explanation.
bool is_explanation(std::string_view text);

/// Throws InputError that names the file and the key.
Explanation explanation_from_json(std::string_view text, const std::string& file);

}  // namespace diastole::explain
