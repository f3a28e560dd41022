#pragma once
// The motion that a study's values explain: what a fit, its Monte Carlo and its design predict alike.

#include <memory>

#include "estimator/fit/elastic_motion.hpp"
#include "estimator/io/study.hpp"

namespace diastole {

/// Of the study's body, `model` (make_affected_model), and of values in these groups. `unload`: the body's shape was imaged under load, and the one
/// without is found with the values (unloaded_motion.hpp); throws InputError as imaged_load_of (unloaded_model.hpp).
std::unique_ptr<ElasticMotion> study_motion(const Study& study, ElasticModel model,
                                            std::vector<ParameterGroup> groups, bool unload);

}  // namespace diastole
