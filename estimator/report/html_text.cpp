#include "estimator/report/html_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace diastole::report {
namespace {

const char* sign_of(double value) { return value < 0 ? "\u2212" : ""; }

}  // namespace

std::string escaped(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '&':
        result += "&amp;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::string drawing(double width, double height, std::string_view body) {
  return fmt::format(
      "<svg class=\"plot\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" role=\"img\">{2}</svg>", width,
      height, body);
}

std::string number(double value, int digits) {
  if (!std::isfinite(value)) return "\u2013";
  const double size = std::abs(value);
  if (size == 0) return "0";
  if (size < 1e-4 || size >= 1e7) return fmt::format("{}{:.{}e}", sign_of(value), size, digits - 1);
  const int decimals = std::max(0, digits - 1 - static_cast<int>(std::floor(std::log10(size))));
  return fmt::format("{}{:.{}f}", sign_of(value), size, decimals);
}

std::string chosen(double value) { return fmt::format("{}{:.6g}", sign_of(value), std::abs(value)); }

std::string with_error(double value, double error) {
  if (!(error > 0) || !std::isfinite(error)) return number(value);
  const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(error))), 0, 9);
  return fmt::format("{}{:.{}f} \u00b1 {:.{}f}", sign_of(value), std::abs(value), decimals, error, decimals);
}

}  // namespace diastole::report
