#include "estimator/report/field_views.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "estimator/report/html_text.hpp"

namespace diastole::report {
namespace {

using explain::FieldResidual;

constexpr size_t layers = 3, least_residuals = 4;

/// Cells so small that the place shows, and so large that some six residuals fall into each.
struct Division {
  explicit Division(size_t residuals) {
    const double part =
        std::clamp(std::sqrt(static_cast<double>(residuals) / (3.0 * 36.0 * 18.0 * 6.0)), 1.0 / 3.0, 1.0);
    turns = static_cast<size_t>(std::lround(36 * part));
    heights = static_cast<size_t>(std::lround(18 * part));
    depths = static_cast<size_t>(std::lround(9 * part));
  }
  size_t turns, heights, depths;
};

/// In the wall's own coordinates.
struct Place {
  double turn, depth, z_mm;  ///< turn and depth from 0 to 1
};

size_t cell(double part, size_t cells) {
  return std::min(cells - 1, static_cast<size_t>(std::max(0.0, part) * static_cast<double>(cells)));
}

struct Wall {
  double low_mm = std::numeric_limits<double>::infinity(), high_mm = -low_mm;
  std::vector<Place> places;
};

/// The wall's inner and outer radius are those of the residuals at the same height.
Wall wall_of(const std::vector<FieldResidual>& residuals, size_t heights) {
  Wall wall;
  for (const FieldResidual& r : residuals) {
    wall.low_mm = std::min(wall.low_mm, r.place_mm[2]);
    wall.high_mm = std::max(wall.high_mm, r.place_mm[2]);
  }
  const double span = std::max(wall.high_mm - wall.low_mm, 1e-9);
  std::vector<double> inner(heights, std::numeric_limits<double>::infinity()), outer(heights, 0.0);
  for (const FieldResidual& r : residuals) {
    const size_t row = cell((r.place_mm[2] - wall.low_mm) / span, heights);
    const double radius = std::hypot(r.place_mm[0], r.place_mm[1]);
    inner[row] = std::min(inner[row], radius);
    outer[row] = std::max(outer[row], radius);
  }
  for (const FieldResidual& r : residuals) {
    const size_t row = cell((r.place_mm[2] - wall.low_mm) / span, heights);
    const double radius = std::hypot(r.place_mm[0], r.place_mm[1]);
    const double turn = std::atan2(r.place_mm[1], r.place_mm[0]) / (2 * std::numbers::pi) + 0.5;
    wall.places.push_back(
        {turn, (radius - inner[row]) / std::max(outer[row] - inner[row], 1e-9), r.place_mm[2]});
  }
  return wall;
}

/// Root mean squares of what falls into each cell.
class Cells {
 public:
  Cells(size_t rows, size_t columns) : sum_(rows, std::vector<double>(columns, 0.0)), count_(sum_) {}
  void add(size_t row, size_t column, double value) {
    sum_[row][column] += value * value;
    count_[row][column] += 1.0;
  }
  [[nodiscard]] CellGrid grid() const {
    CellGrid grid = sum_;
    for (size_t r = 0; r < grid.size(); ++r) {
      for (size_t c = 0; c < grid[r].size(); ++c) {
        grid[r][c] = count_[r][c] < least_residuals ? std::numeric_limits<double>::quiet_NaN()
                                                    : std::sqrt(sum_[r][c] / count_[r][c]);
      }
    }
    return grid;
  }

 private:
  std::vector<std::vector<double>> sum_, count_;
};

}  // namespace

std::vector<FieldView> field_views(const std::vector<FieldResidual>& residuals) {
  const auto [turns, heights, depths] = Division(residuals.size());
  const Wall wall = wall_of(residuals, heights);
  const double span = std::max(wall.high_mm - wall.low_mm, 1e-9);
  std::vector<FieldView> views;
  double worst = 0.0;
  size_t worst_row = heights / 2;
  for (size_t layer = 0; layer < layers; ++layer) {
    Cells before(heights, turns), after(heights, turns);
    for (size_t i = 0; i < residuals.size(); ++i) {
      if (cell(wall.places[i].depth, layers) != layer) continue;
      const size_t row = heights - 1 - cell((wall.places[i].z_mm - wall.low_mm) / span, heights);
      const size_t column = cell(wall.places[i].turn, turns);
      before.add(row, column, residuals[i].before);
      after.add(row, column, residuals[i].after);
    }
    constexpr std::array<const char*, layers> names{"inner", "middle", "outer"};
    views.push_back({fmt::format("The {} third of the wall, unrolled", names[layer]),
                     before.grid(),
                     after.grid(),
                     {wall.high_mm, wall.low_mm},
                     "z (mm)"});
    for (size_t row = 0; row < heights; ++row) {
      for (const double value : views.back().before[row]) {
        if (!(value > worst)) continue;
        worst = value;
        worst_row = row;
      }
    }
  }
  const double half_mm = 1.5 * span / static_cast<double>(heights);
  const double z_mm =
      wall.high_mm - (static_cast<double>(worst_row) + 0.5) / static_cast<double>(heights) * span;
  Cells before(depths, turns), after(depths, turns);
  for (size_t i = 0; i < residuals.size(); ++i) {
    if (std::abs(wall.places[i].z_mm - z_mm) > half_mm) continue;
    const size_t row = depths - 1 - cell(wall.places[i].depth, depths);
    before.add(row, cell(wall.places[i].turn, turns), residuals[i].before);
    after.add(row, cell(wall.places[i].turn, turns), residuals[i].after);
  }
  views.push_back(
      {fmt::format("Across the axis at z = {} mm, from the cavity (0) to the outside (1)", number(z_mm, 2)),
       before.grid(),
       after.grid(),
       {1.0, 0.0},
       "depth in the wall"});
  return views;
}

std::array<double, 2> rms_of(const std::vector<FieldResidual>& residuals) {
  std::array<double, 2> sum{};
  for (const FieldResidual& r : residuals) {
    sum[0] += r.before * r.before;
    sum[1] += r.after * r.after;
  }
  const auto count = static_cast<double>(std::max<size_t>(residuals.size(), 1));
  return {std::sqrt(sum[0] / count), std::sqrt(sum[1] / count)};
}

}  // namespace diastole::report
