// The heart benchmarks of Land et al. on refined meshes, as the tables of docs/verification.md; minutes of work.
//
//   land_table beam|inflated|contracted [MOST_ELEMENTS] > table.md

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <vector>

#include "tools/benchmarks/verification/land_problems.hpp"

namespace diastole {
namespace {

struct LandMesh {
  std::array<size_t, 3> elements;
  double grading;

  [[nodiscard]] std::string name() const {
    const std::string counts = fmt::format("{}×{}×{}", elements[0], elements[1], elements[2]);
    if (grading == 0.0) return counts + ", ungraded";
    return grading < 0.0 ? counts + ", graded to the apex" : counts;
  }
};

constexpr double to_base = 0.8;
constexpr double to_apex = -0.9;

const std::vector<LandMesh> beam_meshes{{{10, 1, 1}, to_base},
                                        {{20, 1, 1}, to_base},
                                        {{20, 2, 2}, to_base},
                                        {{10, 1, 1}, 0.0},
                                        {{20, 2, 2}, 0.0}};
const std::vector<LandMesh> inflated_meshes{{{8, 4, 1}, to_base}, {{8, 4, 2}, to_base}, {{8, 8, 2}, to_base},
                                            {{8, 8, 3}, to_base}, {{8, 8, 2}, 0.0},     {{8, 12, 3}, 0.0}};
const std::vector<LandMesh> contracted_meshes{
    {{8, 4, 2}, to_base}, {{8, 6, 3}, to_base}, {{8, 8, 4}, to_base}, {{8, 4, 2}, 0.0},
    {{8, 8, 2}, 0.0},     {{8, 6, 4}, 0.0},     {{8, 4, 2}, to_apex}, {{8, 6, 2}, to_apex},
    {{8, 6, 3}, to_apex}, {{8, 8, 3}, to_apex}, {{8, 8, 4}, to_apex}, {{12, 6, 2}, to_apex}};

/// Tangents in load steps, and how many negative pivots there are beyond one a pressure unknown.
std::string course_of(const SolveReport& report) {
  if (!report.converged()) return std::string(describe(report.reason));
  return fmt::format("{} + {} in {}, {:+}", report.factorisations,
                     report.newton_iterations - report.factorisations, report.load_steps,
                     static_cast<int>(report.negative_pivots) - static_cast<int>(report.pressure_unknowns));
}

void print_beam(const LandMesh& mesh) {
  const LandBeam beam = land_beam(mesh.elements, mesh.grading);
  fmt::print("| {} | {} | {:.4f} | {:.4f} | {:+.2f} % | {} |\n", mesh.name(), beam.unknowns, beam.tip_mm[0],
             beam.tip_mm[2], 100 * (beam.tip_mm[2] / 4.168 - 1.0), course_of(beam.solution.report));
}

void print_ventricle(const LandMesh& mesh, const LandVentricle& ventricle, bool twists) {
  fmt::print("| {} | {} | {:.3f} | {:.3f} | {:.3f} | {:.4f} |", mesh.name(), ventricle.model.dofs(),
             ventricle.apex_mm(0.0), ventricle.apex_mm(0.5), ventricle.apex_mm(1.0), ventricle.cavity_mL());
  if (twists) {
    fmt::print(" {:.2f}, {:.2f}, {:.2f} |", ventricle.twist_deg(0.25), ventricle.twist_deg(0.5),
               ventricle.twist_deg(0.75));
  }
  fmt::print(" {} |\n", course_of(ventricle.solution.report));
}

bool print_problem(const std::string& problem, size_t most_elements) {
  const auto each = [&](const std::vector<LandMesh>& meshes, const auto& print) {
    for (const LandMesh& mesh : meshes) {
      if (mesh.elements[0] * mesh.elements[1] * mesh.elements[2] > most_elements) continue;
      print(mesh);
      std::fflush(stdout);
    }
    return true;
  };
  constexpr const char* course = "tangents + corrections in load steps, pivots too many";
  if (problem == "beam") {
    fmt::print("| mesh | unknowns | x | z | error of z | {} |\n|---|---|---|---|---|---|\n", course);
    return each(beam_meshes, print_beam);
  }
  const std::string heights = "| mesh | unknowns | endocardium | mid-wall | epicardium | cavity |";
  if (problem == "inflated") {
    fmt::print("{} {} |\n|---|---|---|---|---|---|---|\n", heights, course);
    return each(inflated_meshes, [](const LandMesh& mesh) {
      print_ventricle(mesh, land_inflated(land_ellipsoid(mesh.elements, mesh.grading)), false);
    });
  }
  if (problem == "contracted") {
    fmt::print("{} rotation at 1/4, 1/2, 3/4 | {} |\n|---|---|---|---|---|---|---|---|\n", heights, course);
    return each(contracted_meshes, [](const LandMesh& mesh) {
      print_ventricle(mesh, land_contracted(land_ellipsoid(mesh.elements, mesh.grading)), true);
    });
  }
  return false;
}

}  // namespace
}  // namespace diastole

int main(int argc, char** argv) {
  const size_t most_elements = argc > 2 ? std::stoul(argv[2]) : 1000;
  if (argc < 2 || !diastole::print_problem(argv[1], most_elements)) {
    std::fputs("usage: land_table beam|inflated|contracted [MOST_ELEMENTS] > TABLE.md\n", stderr);
    return 2;
  }
  return 0;
}
