#include "estimator/effects/effect.hpp"

#include <algorithm>
#include <array>

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

std::vector<const Effect*> those_with(std::span<const EffectParameter> (Effect::*parameters)() const) {
  std::vector<const Effect*> shown;
  for (const Effect* effect : all_effects())
    if (!(effect->*parameters)().empty()) shown.push_back(effect);
  return shown;
}

}  // namespace

std::string_view name_of(Port port) {
  constexpr std::array<std::string_view, 5> names{"drive", "specimen", "sensor", "clock", "field"};
  return names[static_cast<size_t>(port)];
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
  static const std::vector<const Effect*> list = those_with(&Effect::parameters);
  return list;
}

const std::vector<const Effect*>& field_effects() {
  static const std::vector<const Effect*> list = those_with(&Effect::field_parameters);
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
