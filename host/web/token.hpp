#pragma once
// The secret that lets a browser in.

#include <string>
#include <string_view>

namespace diastole::web {

/// 128 bits of the kernel's randomness, as 32 hexadecimal digits. Throws HardwareError if the kernel gives none.
std::string new_token();

/// Compares in a time that tells nothing of where the two differ.
bool same_secret(std::string_view a, std::string_view b);

}  // namespace diastole::web
