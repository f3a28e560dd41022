// A ventricle at known parameters against another solver's displacements in the last frame, on several meshes: the table of
// docs/verification.md.
//
//   ventricle_table examples/lv-clean.study.toml > table.md
//
// The study gives body, fibres, frames and points; the parameters are lv-clean's true ones.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <utility>
#include <variant>
#include <vector>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/io/measurement.hpp"
#include "estimator/io/study.hpp"
#include "estimator/mesh/ellipsoid.hpp"
#include "estimator/mesh/point_locator.hpp"

namespace diastole {
namespace {

const std::vector<double> true_values{3.0, 11.09, 1.76, 10.0};  // C (kPa), b1, b2, b3

struct VentricleMesh {
  std::array<size_t, 3> elements;
  double base_grading;
};
constexpr std::array<VentricleMesh, 5> meshes{
    {{{8, 4, 2}, 0.8}, {{8, 6, 3}, 0.8}, {{8, 4, 2}, 0.0}, {{8, 6, 3}, 0.0}, {{12, 8, 2}, 0.0}}};

ElasticModel model_of(const EllipsoidSpecimen& specimen, const VentricleMesh& mesh) {
  EllipsoidShape shape;
  shape.inner_axes_mm = specimen.inner_axes_mm;
  shape.outer_axes_mm = specimen.outer_axes_mm;
  shape.base_z_mm = specimen.base_z_mm;
  shape.base_grading = mesh.base_grading;
  shape.elements = mesh.elements;
  ElasticOptions options{.parameters = true_values};
  options.material_axes =
      material_axes_of(ellipsoid_fibres(shape, specimen.fibre_endo_deg, specimen.fibre_epi_deg));
  return ElasticModel(make_ellipsoid(shape), *find_law("guccione"), std::move(options));
}

void print_row(const Study& study, const Measurement& measurement, const VentricleMesh& mesh) {
  ElasticModel model = model_of(std::get<EllipsoidSpecimen>(study.specimen), mesh);
  const PointLocator locator(model.mesh(), model.mesh().reference(), {.outside_xi = 0.02});
  ElasticState state = model.rest_state();
  const double rest_mL = model.cavity_volume_mL(state);
  for (size_t frame = 1; frame < measurement.frames.size(); ++frame) {
    const Solution solution = model.solve(measurement.frames[frame].pressure_kPa, state);
    if (!solution.report.converged()) throw std::runtime_error(solution.report.describe());
    state = solution.state;
  }
  double sum_mm2 = 0.0;
  double largest_mm = 0.0;
  size_t count = 0;
  for (const ObservedPoint& point : measurement.points) {
    if (static_cast<size_t>(point.frame) + 1 != measurement.frames.size()) continue;
    const auto found = locator.find(Eigen::Map<const Eigen::Vector3d>(point.X_mm.data()));
    if (!found) throw std::runtime_error("a point is not in the body");
    const double miss_mm = (model.mesh().value(state.position_mm, found->point) -
                            Eigen::Map<const Eigen::Vector3d>(point.x_mm.data()))
                               .norm();
    sum_mm2 += miss_mm * miss_mm;
    largest_mm = std::max(largest_mm, miss_mm);
    ++count;
  }
  const double rms_mm = std::sqrt(sum_mm2 / static_cast<double>(count));
  fmt::print("| {}×{}×{}{} | {} | {:.3f} | {:.3f} | {:.3f} |\n", mesh.elements[0], mesh.elements[1],
             mesh.elements[2], mesh.base_grading == 0.0 ? ", ungraded" : "", model.dofs(), rms_mm, largest_mm,
             model.cavity_volume_mL(state) - rest_mL);
  std::fflush(stdout);
}

}  // namespace
}  // namespace diastole

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: ventricle_table STUDY.toml > TABLE.md\n", stderr);
    return 2;
  }
  try {
    const diastole::Study study = diastole::read_study(argv[1]);
    const diastole::Measurement measurement = diastole::read_measurement(study);
    fmt::print("| mesh | unknowns | RMS, all points | largest | ΔV |\n|---|---|---|---|---|\n");
    for (const diastole::VentricleMesh& mesh : diastole::meshes)
      diastole::print_row(study, measurement, mesh);
  } catch (const std::exception& error) {
    fmt::print(stderr, "ventricle_table: {}\n", error.what());
    return 2;
  }
  return 0;
}
