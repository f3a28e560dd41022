#include "estimator/materials/law.hpp"

namespace diastole {

#define DIASTOLE_LAW(name) const Law& name##_law();
#include "estimator/materials/material_list.inc"

size_t Law::parameter_index(std::string_view parameter) const {
  size_t index = 0;
  while (index < parameters().size() && parameters()[index].name != parameter)
    ++index;
  return index;
}

const std::vector<const Law*>& all_laws() {
  static const std::vector<const Law*> laws{
#define DIASTOLE_LAW(name) &name##_law(),
#include "estimator/materials/material_list.inc"
  };
  return laws;
}

const Law* find_law(std::string_view name) {
  for (const Law* law : all_laws()) {
    if (law->name() == name) return law;
  }
  return nullptr;
}

}  // namespace diastole
