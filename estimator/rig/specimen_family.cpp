#include "estimator/rig/specimen_family.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "estimator/fe/pressure_volume.hpp"
#include "estimator/fe/study_model.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::rig {
namespace {

constexpr double plate_kPa_per_mm = 1e5;  ///< holds the ends along the axis
constexpr double softest_mm = 8.0;        ///< where half of the way to free ends is gone, about

void follow(Study study, double to_mL, size_t steps, std::vector<SpecimenCurve::Point>& points) {
  ElasticModel model = make_model(study);
  require_closed_cavity(study, model);
  const PressureVolumeCurve curve = pressure_volume_curve(model, {.volume_change_mL = to_mL, .steps = steps});
  if (!curve.last.converged()) {
    throw InputError({.file = study.file.string(),
                      .place = "specimen",
                      .problem = fmt::format("its pressure-volume curve ends before {} mL: {}", to_mL,
                                             curve.last.describe()),
                      .remedy = "Check it with `diastole pv`; another mesh may help."});
  }
  for (const PressureVolumePoint& point : curve.points)
    points.push_back({point.volume_change_mL, point.pressure_kPa, point.stiffness_kPa_per_mL});
}

bool is_modulus(const StudyParameter& parameter) { return parameter.name.ends_with("_kPa"); }

}  // namespace

SpecimenFamily::SpecimenFamily(Study study, const SpecimenResolution& resolution)
    : study_(std::move(study)), resolution_(resolution) {
  study_.effects.clear();
  std::vector<StudyParameter>& parameters = study_.law.parameters;
  while (modulus_index_ < parameters.size() && !is_modulus(parameters[modulus_index_]))
    ++modulus_index_;
  if (modulus_index_ == parameters.size()) {
    throw InputError(
        {.file = study_.file.string(),
         .place = "law",
         .problem = fmt::format("{} has no modulus in kPa that could be sought", study_.law.name),
         .remedy = "Use a law whose first parameter is a stiffness, such as neo-hookean."});
  }
  modulus_kPa_ = parameters[modulus_index_].start;
  for (StudyParameter& parameter : parameters)
    if (is_modulus(parameter)) parameter.start /= modulus_kPa_;
}

SpecimenCurve SpecimenFamily::compute(const Study& study) const {
  const double spacing_mL = resolution_.spacing_mL;
  std::vector<SpecimenCurve::Point> emptied;
  follow(study, -spacing_mL * static_cast<double>(resolution_.points_emptied), resolution_.points_emptied,
         emptied);
  std::vector<SpecimenCurve::Point> points(emptied.rbegin(), emptied.rend());
  points.pop_back();  // rest, which begins both
  follow(study, spacing_mL * static_cast<double>(resolution_.points_inflated), resolution_.points_inflated,
         points);
  return SpecimenCurve(std::move(points));
}

const StudyParameter& SpecimenFamily::modulus() const { return study_.law.parameters[modulus_index_]; }

bool SpecimenFamily::has_neighbours() const {
  return std::holds_alternative<AnnulusSpecimen>(study_.specimen) && study_.law.name == "neo-hookean";
}

const SpecimenCurve& SpecimenFamily::computed(const std::string& name, const Study& study) const {
  const std::scoped_lock lock(mutex_);
  auto found = curves_.find(name);
  if (found == curves_.end()) found = curves_.emplace(name, compute(study)).first;
  return found->second;
}

const SpecimenCurve& SpecimenFamily::plain() const {
  Study study = study_;
  if (auto* annulus = std::get_if<AnnulusSpecimen>(&study.specimen)) annulus->mesh = resolution_.fine;
  return computed("plain", study);
}

SpecimenCurve SpecimenFamily::between(const std::string& name, const std::vector<double>& nodes, double value,
                                      const Neighbour& neighbour) const {
  Study coarse = study_;
  std::get<AnnulusSpecimen>(coarse.specimen).mesh = resolution_.coarse;
  const SpecimenCurve& base = computed("coarse", coarse);
  SpecimenCurve sum = plain();
  for (const double node : nodes) {
    if (node == 0.0) continue;
    double weight = 1.0;
    for (const double other : nodes)
      if (other != node) weight *= (value - other) / (node - other);
    const SpecimenCurve& at_node = computed(fmt::format("{} {}", name, node), neighbour(node));
    sum = sum.plus(at_node, 1.0, weight).plus(base, 1.0, -weight);
  }
  return sum;
}

SpecimenCurve SpecimenFamily::with_inner_radius(double fraction) const {
  return between("radius", {-0.1, -0.05, 0.0, 0.05, 0.1}, fraction, [&](double node) {
    Study study = study_;
    auto& annulus = std::get<AnnulusSpecimen>(study.specimen);
    annulus.mesh = resolution_.coarse;
    annulus.inner_radius_mm *= 1.0 + node;
    return study;
  });
}

SpecimenCurve SpecimenFamily::stiffened(double beta) const {
  return between("beta", {0.0, 0.75, 1.5, 3.0}, beta, [&](double node) {
    Study study = study_;
    std::get<AnnulusSpecimen>(study.specimen).mesh = resolution_.coarse;
    StudyParameter stiffening = study.law.parameters.front();
    stiffening.name = "beta";
    stiffening.start = node;
    stiffening.lower = 0.0;
    stiffening.upper = 10.0;
    study.law.name = "demiray";
    study.law.parameters.push_back(stiffening);
    return study;
  });
}

SpecimenCurve SpecimenFamily::slipping(double compliance_mm) const {
  // In c / (c + c0) the curve is nearly straight from held to free ends.
  const double way = compliance_mm / (compliance_mm + softest_mm);
  return between("slip", {0.0, 0.25, 0.5, 0.75}, way, [&](double node) {
    Study study = study_;
    auto& annulus = std::get<AnnulusSpecimen>(study.specimen);
    annulus.mesh = resolution_.coarse;
    annulus.ends = "sprung";
    const double compliance = softest_mm * node / (1.0 - node);
    annulus.end_springs = EndSprings{plate_kPa_per_mm, 1.0 / compliance};
    return study;
  });
}

}  // namespace diastole::rig
