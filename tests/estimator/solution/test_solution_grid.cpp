// Solutions as Bezier grids: what VTK's software and the specification's letter find in the file is what the
// model says.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "estimator/fe/point_fields.hpp"
#include "estimator/mesh/ellipsoid.hpp"
#include "estimator/solution/solution_grid.hpp"
#include "tests/estimator/fe/gel.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tests/host/runfile/output_of.hpp"

namespace diastole {
namespace {

constexpr int absent = 77;  // read_vtkhdf.py: the software is not installed

class SolutionGrid : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path(const std::string& name) const { return folder_.path() / name; }

  /// What the model says at random places of each frame; the pressure is tri-linear, so exact as well.
  void write_samples(const ElasticModel& model, const std::vector<SolvedFrame>& frames) const {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> unit(0.05, 0.95);
    nlohmann::json samples;
    for (size_t step = 0; step < frames.size(); ++step) {
      for (size_t element = 0; element < model.mesh().element_count(); ++element) {
        const Xi xi{unit(random), unit(random), unit(random)};
        const PointFields fields = point_fields(model.system(), frames[step].state, {element, xi});
        const auto list = [](const Eigen::Vector3d& v) { return std::vector<double>{v[0], v[1], v[2]}; };
        samples.push_back({{"step", step},
                           {"element", element},
                           {"xi", xi},
                           {"pressure_kPa", frames[step].state.pressure_kPa},
                           {"arrays",
                            {{"", list(fields.reference_mm)},
                             {"displacement_mm", list(fields.displacement_mm)},
                             {"lagrange_pressure_kPa", {fields.lagrange_pressure_kPa}}}}});
      }
    }
    std::ofstream(path("samples.json")) << samples;
  }

  [[nodiscard]] Output read_with(const std::string& software) const {
    const std::string script = std::string(DIASTOLE_SOURCE_DIR) + "/tests/estimator/solution/read_vtkhdf.py";
    return output_of("/usr/bin/python3 " + script + " " + software + " " + path("grid.vtkhdf").string() +
                     " " + path("samples.json").string());
  }

 private:
  test::ScratchFolder folder_;
};

std::vector<SolvedFrame> inflated(ElasticModel& model, const std::vector<double>& pressures_kPa) {
  std::vector<SolvedFrame> frames;
  for (const double pressure_kPa : pressures_kPa) {
    const Solution solution = model.solve(pressure_kPa);
    EXPECT_TRUE(solution.report.converged());
    frames.push_back({0.1 * static_cast<double>(frames.size()), solution.state});
  }
  return frames;
}

ElasticModel fibred_ventricle() {
  EllipsoidShape shape;
  shape.elements = {4, 2, 1};
  ElasticOptions options{.parameters = {2.0, 8.0, 2.0, 4.0}};
  options.material_axes = material_axes_of(ellipsoid_fibres(shape, 60.0, -60.0));
  return ElasticModel(make_ellipsoid(shape), *find_law("guccione"), std::move(options));
}

TEST_F(SolutionGrid, IsReadByTheSpecificationsLetter) {
  ElasticModel model = fibred_ventricle();
  const std::vector<SolvedFrame> frames = inflated(model, {0.3});
  write_vtkhdf(path("grid.vtkhdf"), solution_grid(model, frames));
  write_samples(model, frames);
  const Output read = read_with("h5py");
  if (WEXITSTATUS(read.status) == absent) GTEST_SKIP() << "python3-h5py is absent";
  EXPECT_EQ(read.status, 0) << read.text;
}

TEST_F(SolutionGrid, OfSeveralFramesIsReadByTheSpecificationsLetter) {
  ElasticModel model = gel(6.5, {4, 2, 1});
  const std::vector<SolvedFrame> frames = inflated(model, {0.0, 1.0, 2.0});
  write_vtkhdf(path("grid.vtkhdf"), solution_grid(model, frames));
  write_samples(model, frames);
  const Output read = read_with("h5py");
  if (WEXITSTATUS(read.status) == absent) GTEST_SKIP() << "python3-h5py is absent";
  EXPECT_EQ(read.status, 0) << read.text;
}

TEST_F(SolutionGrid, IsReadByVtkItself) {
  ElasticModel model = fibred_ventricle();
  const std::vector<SolvedFrame> frames = inflated(model, {0.3});
  write_vtkhdf(path("grid.vtkhdf"), solution_grid(model, frames));
  write_samples(model, frames);
  const Output read = read_with("vtk");
  if (WEXITSTATUS(read.status) == absent) GTEST_SKIP() << "python3-vtk9 is absent";
  EXPECT_EQ(read.status, 0) << read.text;
}

TEST_F(SolutionGrid, IsWrittenWholeOrNotAtAll) {
  ElasticModel model = gel(6.5, {4, 1, 1});
  const BezierGrid grid = solution_grid(model, std::vector<SolvedFrame>{{0.0, model.rest_state()}});
  const std::string refusal = test::message_of([&] { write_vtkhdf(path("no/such/folder.vtkhdf"), grid); });
  EXPECT_NE(refusal.find("no/such/folder.vtkhdf"), std::string::npos) << refusal;
  EXPECT_EQ(refusal.find(".part"), std::string::npos) << refusal;
  std::filesystem::create_directories(path("taken.vtkhdf/inside"));
  EXPECT_THROW(write_vtkhdf(path("taken.vtkhdf"), grid), InputError);
  for (const auto& entry : std::filesystem::directory_iterator(path("")))
    EXPECT_EQ(entry.path().filename(), "taken.vtkhdf");
}

TEST(GaussTable, HoldsTheBodysVolumeAndEveryFieldOfEveryPoint) {
  ElasticModel model = fibred_ventricle();
  const std::string table = gauss_table(model, inflated(model, {0.2, 0.3}));
  std::istringstream lines(table);
  std::string line;
  std::getline(lines, line);
  const auto columns = [](const std::string& text) { return std::count(text.begin(), text.end(), ','); };
  const auto width = columns(line);
  EXPECT_NE(line.find(",stress_ff_kPa,"), std::string::npos);
  size_t rows = 0;
  double volume_mm3 = 0.0;
  while (std::getline(lines, line)) {
    ASSERT_EQ(columns(line), width) << line;
    EXPECT_EQ(line.find("nan"), std::string::npos) << line;
    size_t cell = 0;
    for (int comma = 0; comma < 11; ++comma)
      cell = line.find(',', cell) + 1;
    volume_mm3 += std::stod(line.substr(cell));
    ++rows;
  }
  EXPECT_EQ(rows, 2 * model.mesh().element_count() * gauss_points);
  // Ellipsoids of semi-axes (a, c) cut at z: volume pi a^2 (z + 2c/3 - z^3 / (3 c^2)) below the cut.
  const auto below = [](double a, double c, double z) {
    return M_PI * a * a * (z + 2.0 * c / 3.0 - z * z * z / (3.0 * c * c));
  };
  const double exact_mm3 = below(30.0, 60.0, 15.0) - below(21.0, 51.0, 15.0);
  EXPECT_NEAR(volume_mm3 / 2.0, exact_mm3, 0.005 * exact_mm3);
}

}  // namespace
}  // namespace diastole
