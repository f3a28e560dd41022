#include "estimator/model/study_effects.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "estimator/effects/file_effect.hpp"
#include "estimator/io/study_refusal.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole {

EffectLibrary effects_known_to(const Study& study) {
  EffectLibrary library;
  std::map<std::string, std::filesystem::path, std::less<>> read;
  for (const std::filesystem::path& file : study.effect_files) {
    std::shared_ptr<const Effect> effect = read_effect(file);
    const std::string id(effect->text().id);
    if (const auto [first, is_new] = read.emplace(id, file);
        !is_new && !std::filesystem::equivalent(first->second, file))
      refuse(study, "model.effect_files",
             fmt::format("{} and {} both declare {}", first->second.string(), file.string(), id),
             "Give one of them another id.");
    library.add(std::move(effect));
  }
  return library;
}

namespace {

void require_known_parameters(const Study& study, const Effect& effect) {
  const auto stated = std::ranges::find(study.effect_values, effect.text().id, &StudyEffect::id);
  if (stated == study.effect_values.end()) return;
  std::vector<std::string> known;
  for (const auto& parameters : {effect.parameters(), effect.field_parameters()})
    for (const EffectParameter& parameter : parameters)
      if (std::ranges::count(known, parameter.name) == 0) known.emplace_back(parameter.name);
  for (const auto& [name, start] : stated->starts)
    if (std::ranges::count(known, name) == 0)
      refuse(study, fmt::format("model.parameters.{}.{}", effect.text().id, name),
             "the effect has no such parameter",
             did_you_mean(name, known) + fmt::format("It has {}.", fmt::join(known, ", ")));
}

}  // namespace

const Effect& effect_named(const EffectLibrary& library, const Study& study, const std::string& id) {
  if (const Effect* effect = library.find(id)) {
    require_known_parameters(study, *effect);
    return *effect;
  }
  std::vector<std::string> ids;
  for (const Effect* effect : library.all())
    ids.emplace_back(effect->text().id);
  refuse(study, "model.effects", fmt::format("there is no effect \"{}\"", id),
         did_you_mean(id, ids) +
             "`diastole effects` lists those that are known; effect_files = [\"NAME.effect.toml\"] adds your "
             "own.");
}

std::vector<double> stated_field_values(const Study& study, const Effect& effect, const FieldModel& base) {
  std::vector<double> values = effect.field_neutral(base);
  const auto stated = std::ranges::find(study.effect_values, effect.text().id, &StudyEffect::id);
  for (size_t i = 0; stated != study.effect_values.end() && i < values.size(); ++i) {
    const auto start = stated->starts.find(std::string(effect.field_parameters()[i].name));
    if (start != stated->starts.end()) values[i] = start->second;
  }
  return values;
}

}  // namespace diastole
