#include "estimator/fit/study_motion.hpp"

#include <utility>

#include "estimator/fit/unloaded_motion.hpp"
#include "estimator/model/affected_model.hpp"
#include "estimator/model/unloaded_model.hpp"

namespace diastole {

std::unique_ptr<ElasticMotion> study_motion(const Study& study, ElasticModel model,
                                            std::vector<ParameterGroup> groups, bool unload) {
  if (unload)
    return std::make_unique<UnloadedMotion>(std::move(model), std::move(groups), imaged_load_of(study));
  return std::make_unique<ElasticMotion>(std::move(model), std::move(groups), displacement_gain_of(study));
}

}  // namespace diastole
