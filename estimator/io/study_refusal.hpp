#pragma once
// What a study's reader understood and a model cannot take.

#include <string>
#include <utility>

#include "estimator/io/study.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {

/// Throws InputError at a key of the study's file: "law.name", "model.effects".
[[noreturn]] inline void refuse(const Study& study, const std::string& key, std::string problem,
                                std::string remedy) {
  throw InputError({study.file.string(), "key " + key, std::move(problem), std::move(remedy)});
}

}  // namespace diastole
