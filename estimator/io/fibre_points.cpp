#include "estimator/io/fibre_points.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "estimator/io/number_table.hpp"

namespace diastole {
namespace {

constexpr std::array<std::string_view, 7> columns{"x_mm", "y_mm", "z_mm", "fx", "fy", "fz", "sigma_deg"};
constexpr double length_slack = 0.01;  // what three decimals round away

}  // namespace

std::string fibre_points_text(std::span<const FibrePointRow> rows) {
  std::string text(fibre_points_mark);
  text += '\n';
  for (const FibrePointRow& row : rows)
    fmt::format_to(std::back_inserter(text), "{:.4f},{:.4f},{:.4f},{:.6f},{:.6f},{:.6f},{:.4f}\n",
                   row.place_mm[0], row.place_mm[1], row.place_mm[2], row.direction[0], row.direction[1],
                   row.direction[2], row.sigma_deg);
  return text;
}

std::vector<FibrePointRow> read_fibre_points(const std::filesystem::path& file) {
  const NumberTable table = NumberTable::from_file(file, columns);
  std::vector<FibrePointRow> rows;
  for (size_t r = 0; r < table.rows(); ++r) {
    FibrePointRow row{};
    for (size_t i = 0; i < 3; ++i) {
      row.place_mm[i] = table.at(r, i);
      row.direction[i] = table.at(r, 3 + i);
    }
    row.sigma_deg = table.at(r, 6);
    const double length = std::hypot(row.direction[0], row.direction[1], row.direction[2]);
    if (std::abs(length - 1) > length_slack)
      table.fail(r, 3, fmt::format("the direction has length {:.3g}", length),
                 "Give a unit vector; its sign is free.");
    if (!(row.sigma_deg > 0))
      table.fail(r, 6, "is not positive", "Give the direction's standard error in degrees.");
    rows.push_back(row);
  }
  return rows;
}

std::vector<std::array<double, 3>> read_places(const std::filesystem::path& file) {
  const NumberTable table = NumberTable::from_file(file, std::span(columns).first(3));
  std::vector<std::array<double, 3>> places;
  for (size_t r = 0; r < table.rows(); ++r)
    places.push_back({table.at(r, 0), table.at(r, 1), table.at(r, 2)});
  return places;
}

}  // namespace diastole
