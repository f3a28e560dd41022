// The paper's Fig. 3 with this solver: radial displacement at the equator of the gel phantom for several
// meshes at 6 kPa, C1 = 6.5 kPa; and the errors of all three reference loads as a Markdown table.
//
//   convergence_figure docs/figures/convergence.svg > table.md

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <ctime>
#include <optional>
#include <string>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/mesh/annulus.hpp"
#include "estimator/mesh/point_locator.hpp"
#include "tools/benchmarks/verification/line_chart.hpp"

namespace diastole {
namespace {

struct ReferenceLoad {
  double pressure_kPa;
  double c1_kPa;
  std::array<double, 5> radial_mm;
  double volume_change_mL;
};

constexpr std::array<double, 5> radii_mm{22.5, 30.0, 36.25, 43.0, 50.0};
// Converged values; docs/verification.md says where they come from.
constexpr std::array<ReferenceLoad, 3> loads{{{6.0, 6.5, {8.0557, 6.6906, 5.8081, 4.9988, 4.2197}, 78.351},
                                              {3.1, 8.8, {2.6145, 2.1351, 1.8454, 1.5863, 1.3370}, 23.883},
                                              {2.0, 4.0, {3.8584, 3.1649, 2.7384, 2.3545, 1.9851}, 35.761}}};

struct Mesh {
  std::array<size_t, 3> elements;
  bool graded;
};

std::string name_of(const Mesh& mesh) {
  return fmt::format("{}×{}×{}{}", mesh.elements[0], mesh.elements[1], mesh.elements[2],
                     mesh.graded ? "" : " uniform");
}

ElasticModel model_of(const Mesh& mesh, double c1_kPa) {
  AnnulusShape shape;
  shape.elements = mesh.elements;
  if (!mesh.graded) shape.plate_grading = shape.wall_grading = 0.0;
  return ElasticModel(make_annulus(shape), *find_law("neo-hookean"), {.parameters = {c1_kPa}, .threads = 1});
}

double radial_displacement_mm(const ElasticModel& model, const PointLocator& locator,
                              const ElasticState& state, double radius_mm) {
  const std::optional<LocatedPoint> found = locator.find({radius_mm, 0.0, 0.0});
  return model.mesh().value(state.position_mm, found.value().point).head<2>().norm() - radius_mm;
}

/// One table row; the profile of the first load is returned for the figure.
ChartSeries solve_and_print(const Mesh& mesh) {
  ChartSeries profile{name_of(mesh), {}, false};
  for (const ReferenceLoad& load : loads) {
    ElasticModel model = model_of(mesh, load.c1_kPa);
    const std::clock_t begun = std::clock();
    const Solution solution = model.solve(load.pressure_kPa);
    const double processor_s = static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC;
    const PointLocator locator(model.mesh(), model.mesh().reference());
    fmt::print("| {} | {} | {:g}, {:g} |", name_of(mesh), model.dofs(), load.pressure_kPa, load.c1_kPa);
    for (size_t i = 0; i < radii_mm.size(); ++i) {
      const double moved = radial_displacement_mm(model, locator, solution.state, radii_mm[i]);
      fmt::print(" {:+.3f} |", 100.0 * (moved / load.radial_mm[i] - 1.0));
    }
    const double change_mL =
        model.cavity_volume_mL(solution.state) - model.cavity_volume_mL(model.rest_state());
    fmt::print(" {:+.3f} | {} + {} | {:.2f} |\n", 100.0 * (change_mL / load.volume_change_mL - 1.0),
               solution.report.factorisations,
               solution.report.newton_iterations - solution.report.factorisations, processor_s);
    std::fflush(stdout);
    if (&load == &loads.front()) {
      constexpr int samples = 55;
      for (int n = 0; n <= samples; ++n) {
        const double radius = radii_mm.front() + (radii_mm.back() - radii_mm.front()) * n / samples;
        profile.points.push_back({radius, radial_displacement_mm(model, locator, solution.state, radius)});
      }
    }
  }
  return profile;
}

LineChart make_figure() {
  LineChart chart{"Gel phantom at 6 kPa, C1 = 6.5 kPa: radial displacement at the equator",
                  "undeformed radius R (mm)",
                  "radial displacement (mm)",
                  {20.0, 3.0},
                  {52.0, 9.0},
                  {}};
  fmt::print(
      "| mesh | unknowns | P, C1 (kPa) | R 22.5 | 30 | 36.25 | 43 | 50 | ΔV | tangents + corrections | "
      "processor s |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|\n");
  const std::array<Mesh, 8> meshes{{{{4, 1, 1}, true},
                                    {{8, 4, 1}, true},
                                    {{8, 4, 2}, true},
                                    {{8, 6, 2}, true},
                                    {{8, 8, 4}, true},
                                    {{16, 8, 2}, true},
                                    {{8, 4, 1}, false},
                                    {{8, 8, 4}, false}}};
  for (const Mesh& mesh : meshes) {
    ChartSeries profile = solve_and_print(mesh);
    if (mesh.graded) chart.series.push_back(std::move(profile));
  }
  ChartSeries reference{"converged", {}, true};
  for (size_t i = 0; i < radii_mm.size(); ++i)
    reference.points.push_back({radii_mm[i], loads[0].radial_mm[i]});
  chart.series.push_back(std::move(reference));
  return chart;
}

}  // namespace
}  // namespace diastole

int main(int argc, char** argv) {
  return diastole::write_figure(argc, argv, "convergence_figure", diastole::make_figure);
}
