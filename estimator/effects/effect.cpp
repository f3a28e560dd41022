#include "estimator/effects/effect.hpp"

#include <algorithm>

namespace diastole {

#define DIASTOLE_EFFECT(name) const Effect& name##_effect();
#include "estimator/effects/effect_list.inc"
#undef DIASTOLE_EFFECT

std::string_view name_of(Port port) {
  switch (port) {
    case Port::drive:
      return "drive";
    case Port::specimen:
      return "specimen";
    case Port::sensor:
      return "sensor";
    case Port::clock:
      return "clock";
    case Port::field:
      return "field";
  }
  return "";
}

std::vector<double> Effect::neutral(const rig::RigModel&) const {
  std::vector<double> values;
  for (const EffectParameter& parameter : parameters())
    values.push_back(parameter.neutral);
  return values;
}

const std::vector<const Effect*>& all_effects() {
  static const std::vector<const Effect*> list{
#define DIASTOLE_EFFECT(name) &name##_effect(),
#include "estimator/effects/effect_list.inc"
#undef DIASTOLE_EFFECT
  };
  return list;
}

const Effect* find_effect(std::string_view id) {
  const auto& list = all_effects();
  const auto found =
      std::find_if(list.begin(), list.end(), [&](const Effect* effect) { return effect->text().id == id; });
  return found == list.end() ? nullptr : *found;
}

}  // namespace diastole
