#pragma once
// Fibre directions at points, NAME.fibres.csv: x_mm,y_mm,z_mm,fx,fy,fz,sigma_deg. Images' patient coordinates; a direction's sign has no meaning.

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace diastole {

inline constexpr std::string_view fibre_points_mark = "x_mm,y_mm,z_mm,fx,fy,fz,sigma_deg";

struct FibrePointRow {
  std::array<double, 3> place_mm;
  std::array<double, 3> direction;  ///< unit
  double sigma_deg;                 ///< > 0
};

std::string fibre_points_text(std::span<const FibrePointRow> rows);

/// Throws InputError (file, line, column) unless every direction has length 1 within a hundredth and every sigma is positive.
std::vector<FibrePointRow> read_fibre_points(const std::filesystem::path& file);

/// Columns x_mm,y_mm,z_mm.
std::vector<std::array<double, 3>> read_places(const std::filesystem::path& file);

}  // namespace diastole
