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

/// Throws InputError if the study's shape was imaged under load. `purpose` ends the sentence "... but PURPOSE start from the shape without".
inline void require_shape_without_load(const Study& study, const std::string& purpose) {
  if (!study.imaged_at) return;
  refuse(study, "specimen.imaged_at_kPa",
         "the shape was imaged under load, but " + purpose + " start from the shape without",
         "Give that one: `diastole mesh export STUDY --unload -o NAME.mesh.toml` makes a mesh of it. To take "
         "the image as free "
         "of stress, leave imaged_at_kPa out.");
}

}  // namespace diastole
