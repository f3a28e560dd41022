#pragma once
// An entry of the controller's black box in words.

#include <string>

#include "protocol/wire/black_box_messages.hpp"

namespace diastole {

/// "fault 1 (estop): The emergency stop was pressed; ..."
std::string in_words(const wire::BlackBoxEntry& entry);

}  // namespace diastole
