#include "estimator/fit/study_motion.hpp"

#include <utility>

#include "estimator/fit/changed_motion.hpp"
#include "estimator/fit/unloaded_motion.hpp"
#include "estimator/model/affected_model.hpp"
#include "estimator/model/unloaded_model.hpp"

namespace diastole {

std::unique_ptr<ElasticMotion> study_motion(const Study& study, ElasticModel model,
                                            std::vector<ParameterGroup> groups, bool unload) {
  if (unload)
    return std::make_unique<UnloadedMotion>(std::move(model), std::move(groups), imaged_load_of(study));
  if (!shows_in_images(study)) return std::make_unique<ElasticMotion>(std::move(model), std::move(groups));
  const auto body = std::make_shared<ElasticModel>(std::move(model));
  const BodyChanges as_stated{.body = [body](const FieldModel&) { return std::move(*body); },
                              .change = [change = field_change_of(study)](auto) { return change; }};
  return std::make_unique<ChangedMotion>(as_stated, std::move(groups), std::vector<double>{});
}

}  // namespace diastole
