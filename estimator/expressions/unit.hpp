#pragma once
// Units of measurement as dimensions and a scale: what may be added to what, and the factor between kPa and Pa.
//
// A unit is written as products and quotients of names with whole powers: "mL/(s kPa)", "kg/m^3", "1". Names: m cm mm, s
// ms min, kg g, K degC, Hz, L mL uL, kPa Pa mmHg, N J, and the pure numbers 1 % ppm deg rad cycle. degC counts differences.

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace diastole::expressions {

struct Unit {
  /// Twelfths of the powers of length, mass, time, temperature: roots of units are exact.
  std::array<int, 4> twelfths{};
  double scale = 1.0;  ///< one of it in the coherent units of kPa, mL and s, hence cm

  [[nodiscard]] bool same_dimension(const Unit& other) const { return twelfths == other.twelfths; }
  [[nodiscard]] bool is_number() const { return twelfths == std::array<int, 4>{}; }
};

Unit operator*(const Unit& a, const Unit& b);
Unit operator/(const Unit& a, const Unit& b);
/// The unit to the power; none if that is no whole number of twelfths.
std::optional<Unit> to_power(const Unit& unit, double power);

/// By what a number of unit `from` is multiplied to be one of unit `to`: exactly 1 where they are the same. Precondition: of
/// one dimension.
double factor_between(const Unit& from, const Unit& to);

/// None if the text is no unit.
std::optional<Unit> parse_unit(std::string_view text);

/// In kPa, mL and s where that is possible, else in mm, kg, s: "mL/s", "1e-3 kPa", "a pure number", "%".
std::string name_of(const Unit& unit);

}  // namespace diastole::expressions
