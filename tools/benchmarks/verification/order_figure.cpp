// How fast displacement and pressure converge to a made-up solution: a Markdown table and a figure.
//
//   order_figure docs/figures/orders.svg > table.md

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "tools/benchmarks/verification/line_chart.hpp"
#include "tools/benchmarks/verification/manufactured_solution.hpp"

namespace diastole {
namespace {

constexpr std::array<size_t, 5> meshes{2, 3, 4, 6, 8};

struct Measure {
  const char* name;
  const char* label;
  double ManufacturedErrors::*error;
};

constexpr std::array<Measure, 5> measures{
    {{"u in L2, mm", "u, L2", &ManufacturedErrors::displacement_L2_mm},
     {"u in H1", "u, H1", &ManufacturedErrors::displacement_H1},
     {"p in L2, kPa", "p", &ManufacturedErrors::pressure_L2_kPa},
     {"p averaged, kPa", "mean p", &ManufacturedErrors::averaged_pressure_L2_kPa},
     {"stress, kPa", "stress", &ManufacturedErrors::stress_L2_kPa}}};

std::vector<ManufacturedErrors> solve_and_print(const ManufacturedCase& made_up) {
  std::vector<ManufacturedErrors> errors;
  for (const size_t n : meshes) {
    errors.push_back(solve_manufactured(made_up, n));
    fmt::print("| {} | {}³ | {} |", made_up.name, n, errors.back().unknowns);
    for (const Measure& measure : measures) {
      fmt::print(" {:.2e}", errors.back().*measure.error);
      if (errors.size() > 1) {
        const size_t before = errors.size() - 2;
        fmt::print(" ({:.2f})", convergence_order(errors[before].*measure.error, errors.back().*measure.error,
                                                  meshes[before], n));
      }
      fmt::print(" |");
    }
    fmt::print("\n");
    std::fflush(stdout);
  }
  return errors;
}

LineChart make_figure() {
  LineChart chart{"Convergence to a made-up solution: guccione's law, turning fibres",
                  "log10 of the elements along an edge",
                  "log10 of the error",
                  {0.25, -6.0},
                  {1.75, 0.0},
                  {}};
  fmt::print("| law, pressure | mesh | unknowns |");
  for (const Measure& measure : measures)
    fmt::print(" {} (order) |", measure.name);
  fmt::print("\n|---|---|---|---|---|---|---|---|\n");
  for (const ManufacturedCase& made_up : manufactured_cases()) {
    const std::vector<ManufacturedErrors> errors = solve_and_print(made_up);
    if (!made_up.fibres_turn) continue;
    for (const Measure& measure : measures) {
      ChartSeries series{
          fmt::format("{}: {}", made_up.pressure_wave_kPa > 0.0 ? "curved p" : "tri-linear p", measure.name),
          {},
          false};
      for (size_t i = 0; i < meshes.size(); ++i) {
        series.points.push_back(
            {std::log10(static_cast<double>(meshes[i])), std::log10(errors[i].*measure.error)});
      }
      chart.series.push_back(std::move(series));
    }
  }
  return chart;
}

}  // namespace
}  // namespace diastole

int main(int argc, char** argv) {
  return diastole::write_figure(argc, argv, "order_figure", diastole::make_figure);
}
