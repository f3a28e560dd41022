#include "estimator/effects/effect.hpp"

#include <algorithm>
#include <array>
#include <iterator>

namespace diastole {

#define DIASTOLE_EFFECT(name) Effect name##_effect();
#include "estimator/effects/effect_list.inc"

namespace {

std::vector<double> neutral_values(std::span<const EffectParameter> parameters) {
  std::vector<double> values;
  for (const EffectParameter& parameter : parameters)
    values.push_back(parameter.neutral);
  return values;
}

template <class Shown>
std::vector<const Effect*> those_that(Shown shown) {
  std::vector<const Effect*> those;
  std::ranges::copy_if(all_effects(), std::back_inserter(those), shown);
  return those;
}

}  // namespace

std::string_view name_of(Port port) {
  constexpr std::array<std::string_view, 5> names{"drive", "specimen", "sensor", "clock", "field"};
  return names[static_cast<size_t>(port)];
}

std::string_view name_of(FieldSpecimen specimen) {
  constexpr std::array<std::string_view, 5> names{
      "images of gel", "images", "images of other specimens than gel", "images of specimens with fibres",
      "images of specimens held at one end"};
  return names[static_cast<size_t>(specimen)];
}

bool Effect::fits(const rig::SpecimenCurves& family) const {
  return !parameters().empty() && (!declared_.needs_neighbours || family.has_neighbours());
}

std::vector<double> Effect::neutral(const rig::RigModel& base) const {
  return declared_.neutral != nullptr ? declared_.neutral(base) : neutral_values(parameters());
}

std::vector<double> Effect::field_neutral(const FieldModel& base) const {
  return declared_.field_neutral != nullptr ? declared_.field_neutral(base)
                                            : neutral_values(field_parameters());
}

const std::vector<const Effect*>& all_effects() {
  static const Effect effects[] = {
#define DIASTOLE_EFFECT(name) name##_effect(),
#include "estimator/effects/effect_list.inc"
  };
  static const std::vector<const Effect*> list = [] {
    std::vector<const Effect*> pointers;
    for (const Effect& effect : effects)
      pointers.push_back(&effect);
    return pointers;
  }();
  return list;
}

const std::vector<const Effect*>& rig_effects() {
  static const std::vector<const Effect*> list =
      those_that([](const Effect* effect) { return !effect->parameters().empty(); });
  return list;
}

const std::vector<const Effect*>& field_effects() {
  static const std::vector<const Effect*> list = those_that([](const Effect* effect) {
    const FieldSpecimen specimen = effect->text().field_specimen;
    return !effect->field_parameters().empty() &&
           (specimen == FieldSpecimen::gel || specimen == FieldSpecimen::any);
  });
  return list;
}

const std::vector<const Effect*>& specimen_effects() {
  static const std::vector<const Effect*> list = those_that([](const Effect* effect) {
    return !effect->field_parameters().empty() && effect->text().field_specimen != FieldSpecimen::gel;
  });
  return list;
}

const Effect& inclusion_effect() {
  static const Effect& inclusion = **std::ranges::find_if(all_effects(), &Effect::is_inclusion);
  return inclusion;
}

const Effect* find_effect(std::string_view id) {
  const auto found =
      std::ranges::find(all_effects(), id, [](const Effect* effect) { return effect->text().id; });
  return found == all_effects().end() ? nullptr : *found;
}

}  // namespace diastole
