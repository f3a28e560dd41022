#include "tools/benchmarks/annulus_growth.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <limits>
#include <stdexcept>
#include <vector>

#include "tools/benchmarks/verification/line_chart.hpp"

namespace diastole {
namespace {

constexpr std::array<AnnulusElements, 7> meshes{
    {{8, 4, 1}, {8, 6, 2}, {12, 8, 3}, {16, 10, 4}, {16, 12, 5}, {20, 16, 6}, {25, 20, 8}}};

struct Growth {
  const char* what;
  std::function<double(const AnnulusAnswer&)> figure;
  double most_exponent = std::numeric_limits<double>::infinity();
};

const std::array<Growth, 3> growths{
    {{"time of the solution, s", [](const AnnulusAnswer& a) { return a.solve_processor_s; }, 1.5},
     {"peak memory, MB", [](const AnnulusAnswer& a) { return a.process.peak_MB; }},
     {"factor, million entries",
      [](const AnnulusAnswer& a) { return 1e-6 * static_cast<double>(a.factor_entries); }}}};

size_t count_of(const AnnulusElements& elements) { return elements[0] * elements[1] * elements[2]; }

/// Slope of log(figure) over log(unknowns) by least squares.
double exponent(const std::vector<AnnulusAnswer>& answers, const Growth& growth) {
  double mean_x = 0.0;
  double mean_y = 0.0;
  const double count = static_cast<double>(answers.size());
  for (const AnnulusAnswer& answer : answers) {
    mean_x += std::log(static_cast<double>(answer.unknowns)) / count;
    mean_y += std::log(growth.figure(answer)) / count;
  }
  double together = 0.0;
  double square = 0.0;
  for (const AnnulusAnswer& answer : answers) {
    const double x = std::log(static_cast<double>(answer.unknowns)) - mean_x;
    together += x * (std::log(growth.figure(answer)) - mean_y);
    square += x * x;
  }
  return together / square;
}

LineChart chart_of(const std::vector<AnnulusAnswer>& answers) {
  LineChart chart{"Gel annulus at 6 kPa: cost over the size of the mesh",
                  "log10 of the unknowns",
                  "log10 of the cost",
                  {3.0, -2.0},
                  {5.5, 6.0},
                  {}};
  for (const Growth& growth : growths) {
    ChartSeries series{growth.what, {}, false};
    for (const AnnulusAnswer& answer : answers) {
      series.points.push_back(
          {std::log10(static_cast<double>(answer.unknowns)), std::log10(growth.figure(answer))});
    }
    chart.series.push_back(std::move(series));
  }
  return chart;
}

}  // namespace

void measure_growth(const AnnulusSolver& own, size_t most_elements, const std::filesystem::path& figure,
                    const AnnulusWorkplace& place, FigureTargets& targets) {
  std::filesystem::create_directories(place.folder);
  fmt::print(
      "| mesh | elements | unknowns | Newton steps | solution, processor s | ms an element | "
      "factor, million entries | entries an unknown | peak MB |\n|---|---|---|---|---|---|---|---|---|\n");
  std::vector<AnnulusAnswer> answers;
  for (const AnnulusElements& elements : meshes) {
    if (count_of(elements) > most_elements) break;
    const AnnulusAnswer& answer = answers.emplace_back(solve_annulus(own, elements, place));
    const double entries = static_cast<double>(answer.factor_entries);
    fmt::print("| {}×{}×{} | {} | {} | {} | {:.2f} | {:.2f} | {:.1f} | {:.0f} | {:.0f} |\n", elements[0],
               elements[1], elements[2], count_of(elements), answer.unknowns, answer.newton,
               answer.solve_processor_s,
               1e3 * answer.solve_processor_s / static_cast<double>(count_of(elements)), 1e-6 * entries,
               entries / static_cast<double>(answer.unknowns), answer.process.peak_MB);
    std::fflush(stdout);
  }
  if (answers.size() < 2) return;
  fmt::print("\nFitted over the unknowns n:");
  for (const Growth& growth : growths) {
    const double found = exponent(answers, growth);
    const bool has_target = std::isfinite(growth.most_exponent);
    fmt::print(" {} ~ n^{:.2f}{};", growth.what, found,
               has_target ? fmt::format(" ({:g}){}", growth.most_exponent,
                                        targets.mark(found <= growth.most_exponent))
                          : "");
  }
  fmt::print("\n");
  if (figure.empty()) return;
  std::ofstream file(figure);
  file << to_svg(chart_of(answers));
  if (!file.flush()) throw std::runtime_error(figure.string() + " cannot be written");
}

}  // namespace diastole
