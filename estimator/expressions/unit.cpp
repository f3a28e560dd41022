#include "estimator/expressions/unit.hpp"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <charconv>
#include <cmath>

#include "protocol/contract/angle.hpp"

namespace diastole::expressions {
namespace {

constexpr int twelve = 12;

struct Named {
  std::string_view name;
  std::array<int, 4> powers;  ///< of length, mass, time, temperature
  double scale;               ///< in cm, 10 kg, s: then mL, kPa and mL kPa are coherent
};

constexpr std::array known_units{Named{"m", {1, 0, 0, 0}, 100.0},
                                 Named{"cm", {1, 0, 0, 0}, 1.0},
                                 Named{"mm", {1, 0, 0, 0}, 0.1},
                                 Named{"s", {0, 0, 1, 0}, 1.0},
                                 Named{"ms", {0, 0, 1, 0}, 1e-3},
                                 Named{"min", {0, 0, 1, 0}, 60.0},
                                 Named{"kg", {0, 1, 0, 0}, 0.1},
                                 Named{"g", {0, 1, 0, 0}, 1e-4},
                                 Named{"K", {0, 0, 0, 1}, 1.0},
                                 Named{"degC", {0, 0, 0, 1}, 1.0},
                                 Named{"Hz", {0, 0, -1, 0}, 1.0},
                                 Named{"L", {3, 0, 0, 0}, 1000.0},
                                 Named{"mL", {3, 0, 0, 0}, 1.0},
                                 Named{"uL", {3, 0, 0, 0}, 1e-3},
                                 Named{"kPa", {-1, 1, -2, 0}, 1.0},
                                 Named{"Pa", {-1, 1, -2, 0}, 1e-3},
                                 Named{"mmHg", {-1, 1, -2, 0}, 0.133322387415},
                                 Named{"N", {1, 1, -2, 0}, 10.0},
                                 Named{"J", {2, 1, -2, 0}, 1000.0},
                                 Named{"rad", {0, 0, 0, 0}, 1.0},
                                 Named{"cycle", {0, 0, 0, 0}, 1.0},
                                 Named{"deg", {0, 0, 0, 0}, rad_per_deg},
                                 Named{"ppm", {0, 0, 0, 0}, 1e-6},
                                 Named{"%", {0, 0, 0, 0}, 1e-2}};

/// unit := factor { ("/" | "*" | " ") factor }; factor := (name | "1" | "(" unit ")") [ "^" whole number ]
class UnitParser {
 public:
  explicit UnitParser(std::string_view text) : text_(text) {}

  std::optional<Unit> whole() {
    if (skip(); at_end()) return Unit{};
    const auto unit = product();
    return at_end() ? unit : std::nullopt;
  }

 private:
  [[nodiscard]] bool at_end() const { return at_ == text_.size(); }
  [[nodiscard]] char next() const { return at_end() ? '\0' : text_[at_]; }
  void skip() {
    while (next() == ' ')
      ++at_;
  }
  std::optional<Unit> product() {
    std::optional<Unit> unit = factor();
    while (unit) {
      skip();
      const char sign = next();
      if (sign == '\0' || sign == ')') break;
      if (sign == '/' || sign == '*') ++at_;
      const std::optional<Unit> more = factor();
      if (!more) return {};
      unit = sign == '/' ? *unit / *more : *unit * *more;
    }
    return unit;
  }
  std::optional<Unit> factor() {
    skip();
    std::optional<Unit> unit;
    if (next() == '(') {
      if (++depth_ > 8) return {};
      ++at_;
      unit = product();
      if (next() != ')') return {};
      ++at_;
      --depth_;
    } else if (next() == '1') {
      ++at_;
      unit = Unit{};
    } else {
      unit = named();
    }
    if (!unit || next() != '^') return unit;
    int power = 0;
    const char* from = text_.data() + ++at_;
    const auto [end, error] = std::from_chars(from, text_.data() + text_.size(), power);
    if (error != std::errc{} || std::abs(power) > 9) return {};
    at_ += static_cast<size_t>(end - from);
    return to_power(*unit, power);
  }
  std::optional<Unit> named() {
    const size_t from = at_;
    while (std::isalpha(static_cast<unsigned char>(next())) != 0 || next() == '%')
      ++at_;
    const std::string_view name = text_.substr(from, at_ - from);
    for (const Named& known : known_units) {
      if (known.name != name) continue;
      Unit unit{known.powers, known.scale};
      for (int& power : unit.twelfths)
        power *= twelve;
      return unit;
    }
    return {};
  }

  std::string_view text_;
  size_t at_ = 0;
  int depth_ = 0;
};

void append(std::string& above, std::string& below, std::string_view name, double power) {
  if (power == 0.0) return;
  std::string& side = power > 0.0 ? above : below;
  if (!side.empty()) side += ' ';
  side += std::abs(power) == 1.0 ? std::string(name) : fmt::format("{}^{:.3g}", name, std::abs(power));
}

std::string name_of_number(const Unit& unit) {
  if (factor_between(unit, {}) == 1.0) return "a pure number";
  for (const Named& known : known_units)
    if (known.powers == std::array<int, 4>{} && factor_between(unit, {{}, known.scale}) == 1.0)
      return std::string(known.name);
  return fmt::format("a pure number times {:.6g}", unit.scale);
}

}  // namespace

Unit operator*(const Unit& a, const Unit& b) {
  Unit product{a.twelfths, a.scale * b.scale};
  for (size_t i = 0; i < product.twelfths.size(); ++i)
    product.twelfths[i] += b.twelfths[i];
  return product;
}

Unit operator/(const Unit& a, const Unit& b) {
  Unit quotient{a.twelfths, a.scale / b.scale};
  for (size_t i = 0; i < quotient.twelfths.size(); ++i)
    quotient.twelfths[i] -= b.twelfths[i];
  return quotient;
}

std::optional<Unit> to_power(const Unit& unit, double power) {
  Unit result{{}, std::pow(unit.scale, power)};
  for (size_t i = 0; i < unit.twelfths.size(); ++i) {
    const double twelfths = unit.twelfths[i] * power;
    if (std::abs(twelfths - std::round(twelfths)) > 1e-9 || std::abs(twelfths) > 1e6) return {};
    result.twelfths[i] = static_cast<int>(std::lround(twelfths));
  }
  return result;
}

double factor_between(const Unit& from, const Unit& to) {
  constexpr double rounding = 1e-12;
  const double factor = from.scale / to.scale;
  return std::abs(factor - 1.0) < rounding ? 1.0 : factor;
}

std::optional<Unit> parse_unit(std::string_view text) { return UnitParser(text).whole(); }

std::string name_of(const Unit& unit) {
  const double length = unit.twelfths[0] / 12.0;
  const double mass = unit.twelfths[1] / 12.0;
  const double time = unit.twelfths[2] / 12.0;
  const double temperature = unit.twelfths[3] / 12.0;
  double scale = unit.scale;
  std::string above, below;
  if (unit.is_number()) return name_of_number(unit);
  const double volume = (length + mass) / 3.0;
  append(above, below, "kPa", mass);
  if (volume == std::round(volume)) {
    append(above, below, "mL", volume);
  } else {
    append(above, below, "mm", length + mass);
    scale /= std::pow(0.1, length + mass);
  }
  append(above, below, "s", time + 2.0 * mass);
  append(above, below, "K", temperature);
  if (above == "kPa" && below.empty() && std::abs(scale / 1e-3 - 1.0) < 1e-9) return "Pa";
  std::string name = above.empty() ? "1" : above;
  if (!below.empty()) name += below.find(' ') == std::string::npos ? "/" + below : "/(" + below + ")";
  if (std::abs(scale - 1.0) > 1e-9) name = fmt::format("{:.6g} {}", scale, name);
  return name;
}

}  // namespace diastole::expressions
