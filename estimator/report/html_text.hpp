#pragma once
// Text and numbers as the report writes them.

#include <string>
#include <string_view>

namespace diastole::report {

/// `<`, `>`, `&` and `"` as entities: every text that comes from a file passes through here.
std::string escaped(std::string_view text);

/// `value` with `digits` significant digits, without exponent between 1e-4 and 1e6, and a true minus sign.
std::string number(double value, int digits = 4);

/// A drawing with the page's colours; sizes in viewBox units.
std::string drawing(double width, double height, std::string_view body);

/// The shortest text of a number that somebody chose (a bound, a period): "6", "0.25".
std::string chosen(double value);

/// "8.57 ± 0.08": both rounded to the second significant digit of `error`.
std::string with_error(double value, double error);

}  // namespace diastole::report
