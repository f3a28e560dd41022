#pragma once
// docs/effects.md, made of the effects' declarations.

#include <string>

namespace diastole {

std::string effects_page();

}  // namespace diastole
