#include "estimator/fit/estimated_parameters.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "protocol/contract/input_error.hpp"

namespace diastole {

double ParameterRun::se_of_mean(const Eigen::MatrixXd& covariance) const {
  const auto start = static_cast<Eigen::Index>(first), size = static_cast<Eigen::Index>(count);
  return std::sqrt(covariance.block(start, start, size, size).sum()) / static_cast<double>(count);
}

std::vector<double> EstimatedParameters::starts() const {
  std::vector<double> starts;
  for (const EstimatedParameter& value : values)
    starts.push_back(value.start);
  return starts;
}

std::vector<double> EstimatedParameters::se_percent(const Eigen::MatrixXd& covariance) const {
  std::vector<double> result;
  for (const ParameterRun& run : runs) {
    const double se = run.se_of_mean(covariance);
    const bool relative = values[run.first].scale == inference::Scale::logarithmic;
    result.push_back(100 * (relative ? se : se / std::abs(run.parameter.start)));
  }
  return result;
}

EstimatedParameters estimated_parameters(const Study& study, const ElasticModel& model) {
  EstimatedParameters estimated;
  for (const StudyParameter& parameter : study.law.parameters) {
    const size_t index = model.law().parameter_index(parameter.name);
    const LawParameter& of_law = model.law().parameters()[index];
    const auto refuse_bounds = [&](std::string problem, std::string remedy) {
      throw InputError({study.file.string(), fmt::format("key law.parameters.{}.bounds", parameter.name),
                        std::move(problem), std::move(remedy)});
    };
    if (!(parameter.lower > of_law.above))
      refuse_bounds(fmt::format("the lower bound {} is not above {}", parameter.lower, of_law.above),
                    "Choose a larger lower bound: the law has no meaning there.");
    if (parameter.upper > of_law.at_most)
      refuse_bounds(fmt::format("the upper bound {} is above {}", parameter.upper, of_law.at_most),
                    "Choose a smaller upper bound, or widen the bounds in the law's file.");
    const std::vector<ParameterGroup> groups = parameter.vary == Variation::whole
                                                   ? std::vector{whole_parameter(index)}
                                                   : each_element(index, model.mesh().element_count());
    const std::string unit(of_law.unit == "1" ? "" : of_law.unit);
    const size_t first = estimated.values.size();
    estimated.runs.push_back({parameter, first, groups.size(), of_law.is_modulus()});
    const Smoothness& smoothness = parameter.smoothness;
    if (parameter.vary == Variation::element && smoothness.kind != Smoothness::Kind::none) {
      const bool given = smoothness.kind == Smoothness::Kind::given;
      estimated.smooth.push_back({first, given ? std::optional(smoothness.step) : std::nullopt});
    }
    for (const ParameterGroup& group : groups) {
      estimated.groups.push_back(group);
      const std::string name = groups.size() == 1
                                   ? parameter.name
                                   : fmt::format("{}[{}]", parameter.name, estimated.values.size() - first);
      estimated.values.emplace_back(parameter.start, parameter.lower, parameter.upper, name, unit);
    }
  }
  return estimated;
}

}  // namespace diastole
