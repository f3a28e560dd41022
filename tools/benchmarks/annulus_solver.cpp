#include "tools/benchmarks/annulus_solver.hpp"

#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/fe/elastic_system.hpp"
#include "estimator/mesh/annulus.hpp"
#include "estimator/mesh/point_locator.hpp"

namespace diastole {
namespace {

constexpr double pressure_kPa = 6.0;
constexpr double c1_kPa = 6.5;

std::vector<std::string> filled(const std::vector<std::string>& command, const AnnulusElements& elements,
                                const AnnulusWorkplace& place) {
  std::vector<std::string> words;
  for (const std::string& word : command) {
    words.push_back(fmt::format(fmt::runtime(word), elements[0], elements[1], elements[2],
                                (place.folder / "result.json").string(), place.peers.string()));
  }
  return words;
}

ProcessCost run_step(const AnnulusSolver& solver, const char* step, const std::vector<std::string>& command,
                     const AnnulusElements& elements, const AnnulusWorkplace& place) {
  const std::filesystem::path log = place.folder / fmt::format("{}.log", step);
  const ProcessCost figures = run_timed(filled(command, elements, place), place.folder, log);
  if (figures.exit_code != 0) {
    throw std::runtime_error(fmt::format("{} failed with code {}; its output is in {}", solver.name,
                                         figures.exit_code, log.string()));
  }
  return figures;
}

}  // namespace

double AnnulusAnswer::worst_error() const {
  double worst = 0.0;
  for (size_t i = 0; i < radial_mm.size(); ++i) {
    const double error = radial_mm[i] / annulus_radial_mm[i] - 1.0;
    if (std::abs(error) > std::abs(worst)) worst = error;
  }
  return worst;
}

std::vector<AnnulusSolver> annulus_solvers(const std::string& own_program) {
  const std::string python = "/usr/bin/python3";  // Debian's own, which Debian's modules belong to
  return {
      {"Diastole",
       "tri-cubic Hermite, discontinuous tri-linear pressure",
       {},
       {},
       {own_program, "--solve", "{0}", "{1}", "{2}", "{3}"},
       {},
       {{4, 2, 1}, {6, 3, 1}, {4, 4, 1}, {6, 4, 1}, {8, 4, 1}, {6, 6, 2}, {8, 6, 2}, {8, 8, 4}}},
      {"FEniCSx",
       "27-node bricks, element-wise linear pressure; MUMPS",
       {python, "-c", "import dolfinx"},
       {},
       {python, "{4}/fenicsx.py", "{0}", "{1}", "{2}", "{3}"},
       {},
       {{6, 4, 2}, {6, 6, 2}, {8, 4, 2}, {8, 6, 2}, {8, 8, 2}, {8, 8, 3}, {12, 8, 3}, {12, 12, 4}}},
      {"CalculiX",
       "20-node bricks, reduced integration, bulk modulus 1000 C1; SPOOLES",
       {"ccx", "-v"},
       {python, "{4}/calculix.py", "write", "{0}", "{1}", "{2}", "annulus.inp"},
       {"ccx", "-i", "annulus"},
       {python, "{4}/calculix.py", "read", "{0}", "{1}", "{2}", "annulus.dat", "solve.log", "{3}"},
       {{8, 6, 2}, {8, 8, 3}, {12, 12, 6}}},
  };
}

bool is_installed(const AnnulusSolver& solver, const AnnulusWorkplace& place) {
  std::filesystem::create_directories(place.folder);
  if (solver.probe.empty()) return true;
  const int code = run_timed(solver.probe, place.folder, place.folder / "probe.log").exit_code;
  constexpr int usage = 201;  // what ccx ends with after printing its version
  return code == 0 || code == usage;
}

AnnulusAnswer solve_annulus(const AnnulusSolver& solver, const AnnulusElements& elements,
                            const AnnulusWorkplace& place) {
  std::filesystem::remove(place.folder / "result.json");
  if (!solver.prepare.empty()) run_step(solver, "prepare", solver.prepare, elements, place);
  AnnulusAnswer answer;
  answer.elements = elements;
  answer.process = run_step(solver, "solve", solver.solve, elements, place);
  if (!solver.read.empty()) run_step(solver, "read", solver.read, elements, place);
  std::ifstream file(place.folder / "result.json");
  const nlohmann::json result = nlohmann::json::parse(file);
  if (!result.at("converged").get<bool>()) throw std::runtime_error(solver.name + " did not converge");
  answer.unknowns = result.at("unknowns");
  answer.newton = result.at("newton");
  answer.factor_entries = result.value("factor_entries", size_t{0});
  answer.radial_mm = result.at("radial_mm");
  answer.solve_wall_s = result.value("solve_s", answer.process.wall_s);
  answer.solve_processor_s = result.value("solve_processor_s", answer.process.processor_s);
  return answer;
}

void solve_annulus_here(const AnnulusElements& elements, const std::filesystem::path& result) {
  AnnulusShape shape;
  shape.elements = elements;
  ElasticModel model(make_annulus(shape), *find_law("neo-hookean"), {.parameters = {c1_kPa}, .threads = 1});
  const std::clock_t begun = std::clock();
  const Solution solution = model.solve(pressure_kPa);
  const double processor_s = static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC;
  const PointLocator locator(model.mesh(), model.mesh().reference());
  std::array<double, 5> radial_mm{};
  for (size_t i = 0; i < radial_mm.size(); ++i) {
    const std::optional<LocatedPoint> found = locator.find({annulus_radii_mm[i], 0.0, 0.0});
    const Eigen::Vector3d x = model.mesh().value(solution.state.position_mm, found.value().point);
    radial_mm[i] = x.head<2>().norm() - annulus_radii_mm[i];
  }
  const SolveReport& report = solution.report;
  std::ofstream(result) << nlohmann::json{
      {"converged", report.converged()},
      {"unknowns", model.dofs()},
      {"factor_entries", model.system().factor_entries()},
      {"newton", fmt::format("{} + {} with kept factors", report.factorisations,
                             report.newton_iterations - report.factorisations)},
      {"solve_s", report.seconds},
      {"solve_processor_s", processor_s},
      {"radial_mm", radial_mm}};
}

}  // namespace diastole
