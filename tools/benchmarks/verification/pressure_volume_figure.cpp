// The pressure-volume curve of a rubber-like sphere over its maximum, by held volume: table rows and a figure.
//
//   pressure_volume_figure docs/figures/sphere.svg > table.md

#include <fmt/format.h>

#include "estimator/fe/pressure_volume.hpp"
#include "tools/benchmarks/verification/line_chart.hpp"
#include "tools/benchmarks/verification/sphere.hpp"

namespace diastole {
namespace {

constexpr HalfSphere sphere;
constexpr double end_mL = 60.0;

PressureVolumeCurve solve_and_print(std::array<size_t, 3> elements) {
  ElasticModel model = sphere.model(elements);
  const PressureVolumeCurve curve = pressure_volume_curve(model, {.volume_change_mL = end_mL, .steps = 15});
  for (const size_t n : {2U, 6U, 15U}) {
    const PressureVolumePoint& point = curve.points.at(n);
    fmt::print("| {}×{}×{} | {:.0f} | {:.4f} | {:.4f} | {:.4f} at {:.2f} |\n", elements[0], elements[1],
               elements[2], point.volume_change_mL, point.pressure_kPa,
               sphere.pressure_kPa(point.volume_change_mL), curve.limits.at(0).pressure_kPa,
               curve.limits.at(0).volume_change_mL);
  }
  return curve;
}

LineChart make_figure() {
  LineChart chart{"Half a spherical shell, radii 20 and 23 mm, C1 6.5 kPa",
                  "volume taken (mL)",
                  "pressure (kPa)",
                  {0.0, 0.0},
                  {end_mL, 2.5},
                  {}};
  ChartSeries closed{"closed form", {}};
  for (double volume_mL = 0.0; volume_mL <= end_mL; volume_mL += 0.5)
    closed.points.push_back({volume_mL, sphere.pressure_kPa(volume_mL)});
  chart.series.push_back(closed);
  solve_and_print({8, 2, 1});
  ChartSeries solved{"8×4×2, volume held", {}, true};
  for (const PressureVolumePoint& point : solve_and_print({8, 4, 2}).points)
    solved.points.push_back({point.volume_change_mL, point.pressure_kPa});
  chart.series.push_back(solved);
  return chart;
}

}  // namespace
}  // namespace diastole

int main(int argc, char** argv) {
  return diastole::write_figure(argc, argv, "pressure_volume_figure", diastole::make_figure);
}
