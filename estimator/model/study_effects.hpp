#pragma once
// The effects that a study can have: the built-in ones and those of its [model] effect_files.

#include "estimator/effects/effect_library.hpp"
#include "estimator/io/study.hpp"

namespace diastole {

/// Throws InputError for a file that is no effect, or two of one id.
EffectLibrary effects_known_to(const Study& study);

/// One of a library by its id; throws InputError at model.effects of the study's file, or at model.parameters where the
/// study states a value of a parameter that the effect does not have.
const Effect& effect_named(const EffectLibrary& library, const Study& study, const std::string& id);

/// The values of an effect's field_parameters that the study states, neutral for `base` where it states none.
std::vector<double> stated_field_values(const Study& study, const Effect& effect, const FieldModel& base);

}  // namespace diastole
