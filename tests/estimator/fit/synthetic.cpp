#include "tests/estimator/fit/synthetic.hpp"

#include <cmath>
#include <random>

#include "estimator/fit/elastic_motion.hpp"
#include "estimator/mesh/annulus.hpp"

namespace diastole::test {
namespace {

std::array<double, 3> array_of(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

Eigen::Vector3d tag_normal(size_t number) {
  const double r = std::sqrt(0.5);
  const Eigen::Vector3d normals[] = {{r, r, 0}, {r, -r, 0}, {r, 0, r}, {0, r, -r}};
  return normals[number % std::size(normals)];
}

class Sampler {
 public:
  explicit Sampler(unsigned seed) : generator_(seed) {}

  Eigen::Vector3d place_mm() {
    std::uniform_real_distribution<double> unit(0, 1);
    const double radius_mm = 22.6 + 27.3 * unit(generator_), angle = 2 * M_PI * unit(generator_);
    return {radius_mm * std::cos(angle), radius_mm * std::sin(angle), -40 + 80 * unit(generator_)};
  }
  double normal() { return normal_(generator_); }

 private:
  std::mt19937 generator_;
  std::normal_distribution<double> normal_;
};

}  // namespace

ElasticModel coarse_gel(double C1_kPa) {
  AnnulusShape shape;
  shape.elements = {4, 2, 1};
  ElasticOptions options;
  options.parameters = {C1_kPa};
  return {make_annulus(shape), *find_law("neo-hookean"), std::move(options)};
}

Measurement synthetic(ElasticModel& truth, const SyntheticOptions& options) {
  Measurement measurement;
  Sampler sampler(options.seed);
  const HermiteMesh& mesh = truth.mesh();
  const PointLocator reference(mesh, mesh.reference());
  std::vector<double> pressures_kPa = {0.0};
  pressures_kPa.insert(pressures_kPa.end(), options.pressures_kPa.begin(), options.pressures_kPa.end());
  for (size_t number = 0; number < pressures_kPa.size(); ++number) {
    const int frame = static_cast<int>(number);
    const NodeField position_mm =
        number == 0 ? mesh.reference() : truth.solve(pressures_kPa[number]).state.position_mm;
    const double error_kPa = number == 0 ? 0 : options.noise * options.sigma_kPa * sampler.normal();
    measurement.frames.push_back({0.1 * frame, pressures_kPa[number] + error_kPa, options.sigma_kPa});
    const double spread_mm = options.noise * options.sigma_mm;
    for (size_t i = 0; i < options.tags_a_frame; ++i) {
      const MaterialPoint point = reference.find(sampler.place_mm()).value().point;
      const Eigen::Vector3d normal = tag_normal(i);
      const Eigen::Vector3d seen_mm = mesh.value(position_mm, point) + spread_mm * sampler.normal() * normal;
      measurement.tags.push_back({frame, array_of(normal), normal.dot(mesh.value(mesh.reference(), point)),
                                  array_of(seen_mm), options.sigma_mm});
    }
    for (size_t i = 0; i < options.points_a_frame; ++i) {
      const MaterialPoint point = reference.find(sampler.place_mm()).value().point;
      const Eigen::Vector3d noise_mm(sampler.normal(), sampler.normal(), sampler.normal());
      measurement.points.push_back({frame, array_of(mesh.value(mesh.reference(), point)),
                                    array_of(mesh.value(position_mm, point) + spread_mm * noise_mm),
                                    options.sigma_mm});
    }
  }
  return measurement;
}

FitOutcome fit_C1(const Measurement& measurement, EstimatedParameter estimated) {
  ElasticMotion motion(coarse_gel(estimated.start), {whole_parameter(0)});
  return fit_motion(motion, {estimated}, measurement, {});
}

}  // namespace diastole::test
