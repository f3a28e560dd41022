#pragma once
// Drawn sections, fields and lists of numbers as JSON, for the files that `diastole report` reads. Numbers are kept to
// six significant digits, which is more than a drawing shows; JSON has no NaN, which is written as null.
// Readers throw nlohmann::json::exception or std::invalid_argument, which files turn into an InputError.

#include <nlohmann/json.hpp>
#include <vector>

#include "estimator/io/solution_file.hpp"

namespace diastole {

using Json = nlohmann::ordered_json;

Json from_numbers(const std::vector<double>& values);
std::vector<double> to_numbers(const Json& json);

Json from_fields(const std::vector<NamedField>& fields);
/// Each field must have `count` values.
std::vector<NamedField> to_fields(const Json& json, size_t count);

Json from_section(const SolutionSection& section);
SolutionSection to_section(const Json& json);

}  // namespace diastole
