#include "tests/estimator/explain/simulated_ventricle.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <fstream>
#include <numbers>
#include <random>
#include <stdexcept>

#include "estimator/fit/changed_motion.hpp"
#include "estimator/model/changed_specimen.hpp"

namespace diastole::test {
namespace {

constexpr std::string_view study_text = R"(format = "diastole-study"
version = 1

[specimen]
kind = "ellipsoid"
inner_axes_mm = [21.0, 51.0]
outer_axes_mm = [30.0, 60.0]
base_z_mm = 15.0
fibre_endo_deg = 60.0
fibre_epi_deg = -60.0
mesh = [{}]
ends = "fixed"

[law]
name = "guccione"
[law.parameters.C_kPa]
start = {}
bounds = [0.2, 12.0]
[law.parameters.b1]
start = {}
bounds = [1.0, 60.0]
[law.parameters.b2]
start = {}
bounds = [0.2, 20.0]
[law.parameters.b3]
start = {}
bounds = [0.5, 50.0]

[data]
points = "lv.points.csv"
frames = "lv.frames.csv"
)";

Study study_in(const std::filesystem::path& folder, const char* file, const char* mesh,
               const std::array<double, 4>& law) {
  std::ofstream(folder / file) << fmt::format(study_text, mesh, law[0], law[1], law[2], law[3]);
  return read_study(folder / file);
}

}  // namespace

Study simulated(const SimulatedVentricle& ventricle, const std::filesystem::path& folder) {
  constexpr std::array<double, 5> pressures_kPa{0.4, 0.8, 1.2, 1.6, 2.0};
  constexpr double pressure_sigma_kPa = 0.01;
  std::filesystem::create_directories(folder);
  const Study truth = study_in(folder, "truth.study.toml", ventricle.mesh, ventricle.law);
  const ChangeableSpecimen specimen(truth);
  const BodyChanges changes{.body = [&](const FieldModel& change) { return specimen.with(change); },
                            .change = [&](auto) { return ventricle.truth; }};
  ChangedMotion motion(changes, {}, {});
  std::mt19937_64 random(ventricle.seed);
  std::normal_distribution<double> noise;
  std::uniform_real_distribution<double> share;
  std::uniform_int_distribution<size_t> element(0, specimen.mesh().element_count() - 1);
  std::ofstream points(folder / "lv.points.csv");
  std::ofstream frames(folder / "lv.frames.csv");
  points << "frame,X_mm,Y_mm,Z_mm,x_mm,y_mm,z_mm,sigma_mm\n";
  frames << "frame,time_s,pressure_kPa,sigma_kPa\n0,0,0,0.0001\n";
  for (size_t slot = 0; slot < pressures_kPa.size(); ++slot) {
    const double pressure_kPa = pressures_kPa[slot];
    const MotionOutcome outcome = motion.solve(slot, {}, pressure_kPa);
    if (!outcome.position_mm) throw std::runtime_error("the simulated ventricle has no equilibrium");
    frames << fmt::format("{},{:.2f},{:.5f},{}\n", slot + 1, 0.1 * static_cast<double>(slot + 1),
                          pressure_kPa + pressure_sigma_kPa * noise(random), pressure_sigma_kPa);
    const double load = pressure_kPa / pressures_kPa.back();
    const Eigen::AngleAxisd twist(load * ventricle.twist_deg * std::numbers::pi / 180.0,
                                  Eigen::Vector3d::UnitZ());
    for (size_t i = 0; i < ventricle.points; ++i) {
      const MaterialPoint point{element(random), {share(random), share(random), share(random)}};
      const Eigen::Vector3d X_mm = specimen.mesh().value(specimen.mesh().reference(), point);
      Eigen::Vector3d x_mm = twist * specimen.mesh().value(*outcome.position_mm, point);
      const double below = (15.0 - X_mm[2]) / 75.0;
      x_mm[0] += load * ventricle.sag_mm * below * below;
      for (double& number : x_mm)
        number += ventricle.sigma_mm * noise(random);
      points << fmt::format("{},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{}\n", slot + 1, X_mm[0], X_mm[1],
                            X_mm[2], x_mm[0], x_mm[1], x_mm[2], ventricle.sigma_mm);
    }
  }
  points.close();
  frames.close();
  return study_in(folder, "lv.study.toml", "6, 4, 1", {2.0, 16.0, 2.4, 8.0});
}

}  // namespace diastole::test
