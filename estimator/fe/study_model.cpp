#include "estimator/fe/study_model.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "estimator/mesh/annulus.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole {
namespace {

[[noreturn]] void refuse(const Study& study, std::string key, std::string problem, std::string remedy) {
  throw InputError({.file = study.file.string(),
                    .place = "key " + std::move(key),
                    .problem = std::move(problem),
                    .remedy = std::move(remedy)});
}

const Law& law_of(const Study& study) {
  if (const Law* law = find_law(study.law.name)) return *law;
  std::vector<std::string> known;
  for (const Law* law : all_laws())
    known.emplace_back(law->name());
  refuse(study, "law.name", fmt::format("no law is called \"{}\"", study.law.name),
         fmt::format("Did you mean \"{}\"? Known: {}.", nearest_word(study.law.name, known),
                     fmt::join(known, ", ")));
}

std::vector<double> start_values(const Study& study, const Law& law) {
  std::vector<std::string> known;
  for (const LawParameter& parameter : law.parameters())
    known.emplace_back(parameter.name);
  for (const StudyParameter& given : study.law.parameters) {
    if (law.parameter_index(given.name) == law.parameters().size()) {
      refuse(study, "law.parameters." + given.name,
             fmt::format("the law {} has no such parameter", law.name()),
             fmt::format("Did you mean {}?", nearest_word(given.name, known)));
    }
  }
  std::vector<double> values;
  for (const LawParameter& parameter : law.parameters()) {
    const auto given = std::find_if(study.law.parameters.begin(), study.law.parameters.end(),
                                    [&](const StudyParameter& p) { return p.name == parameter.name; });
    if (given == study.law.parameters.end()) {
      refuse(study, "law.parameters", fmt::format("{} is missing ({})", parameter.name, parameter.meaning),
             fmt::format("Add [law.parameters.{}] with start and bounds.", parameter.name));
    }
    if (!(given->start > parameter.above)) {
      refuse(study, fmt::format("law.parameters.{}.start", parameter.name),
             fmt::format("{} is not above {}", given->start, parameter.above), "Choose a larger start.");
    }
    values.push_back(given->start);
  }
  return values;
}

}  // namespace

ElasticModel make_model(const Study& study, SolveOptions options) {
  const Law& law = law_of(study);
  if (!study.effects.empty()) {
    refuse(study, "model.effects", fmt::format("the model has no effect \"{}\"", study.effects.front()),
           "Leave the list empty.");
  }
  const AnnulusSpecimen& specimen = std::get<AnnulusSpecimen>(study.specimen);
  AnnulusShape shape;
  shape.inner_radius_mm = specimen.inner_radius_mm;
  shape.outer_radius_mm = specimen.outer_radius_mm;
  shape.height_mm = specimen.height_mm;
  for (size_t i = 0; i < 3; ++i)
    shape.elements[i] = static_cast<size_t>(specimen.mesh[i]);
  ElasticOptions elastic;
  elastic.parameters = start_values(study, law);
  elastic.solve = std::move(options);
  return ElasticModel(make_annulus(shape), law, std::move(elastic));
}

}  // namespace diastole
