#pragma once
// Pictures of grey levels inside a page.

#include <string>

namespace diastole::report {

/// A data address of a bitmap file that every browser draws. `grey` holds rows x columns levels, row by row from the top.
std::string bitmap(const std::string& grey, int rows, int columns);

}  // namespace diastole::report
