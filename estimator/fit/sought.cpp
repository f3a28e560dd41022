#include "estimator/fit/sought.hpp"

#include <fmt/format.h>

#include "protocol/contract/input_error.hpp"

namespace diastole {

size_t value_count(const StudyParameter& parameter, size_t elements) {
  return parameter.vary == Variation::whole ? 1 : elements;
}

Sought sought_of(const Study& study, const ElasticModel& model) {
  Sought sought;
  for (const StudyParameter& parameter : study.law.parameters) {
    const size_t index = model.law().parameter_index(parameter.name);
    const double above = model.law().parameters()[index].above;
    if (!(parameter.lower > above)) {
      throw InputError({study.file.string(), fmt::format("key law.parameters.{}.bounds", parameter.name),
                        fmt::format("the lower bound {} is not above {}", parameter.lower, above),
                        "Choose a larger lower bound: the law has no meaning there."});
    }
    const std::vector<ParameterGroup> groups = parameter.vary == Variation::whole
                                                   ? std::vector{whole_parameter(index)}
                                                   : each_element(index, model.mesh().element_count());
    const Smoothness& smoothness = parameter.smoothness;
    if (parameter.vary == Variation::element && smoothness.kind != Smoothness::Kind::none) {
      const bool given = smoothness.kind == Smoothness::Kind::given;
      sought.smooth.push_back({sought.values.size(), given ? std::optional(smoothness.step) : std::nullopt});
    }
    for (const ParameterGroup& group : groups) {
      sought.groups.push_back(group);
      sought.values.push_back({parameter.start, parameter.lower, parameter.upper});
    }
  }
  return sought;
}

}  // namespace diastole
