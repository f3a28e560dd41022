#include "estimator/model/specimen_family.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/fe/pressure_volume.hpp"
#include "estimator/io/cache.hpp"
#include "estimator/io/fingerprint.hpp"
#include "estimator/io/record_file.hpp"
#include "estimator/io/study_refusal.hpp"
#include "estimator/model/study_model.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole::rig {
namespace {

constexpr double plate_kPa_per_mm = 1e5;  ///< holds the ends along the axis
/// The edges at the held ends are corners: of what the fine mesh changes, so much again is missing (Richardson).
constexpr double still_missing = 0.3;
constexpr double softest_mm = 8.0;  ///< where half of the way to free ends is gone, about

void follow(Study study, double to_mL, size_t steps, std::vector<SpecimenCurve::Point>& points) {
  ElasticModel model = make_model(study);
  require_closed_cavity(study, model);
  const PressureVolumeCurve curve =
      pressure_volume_curve(model, {.volume_change_mL = to_mL, .steps = steps, .judge_stability = false});
  if (!curve.last.converged()) {
    throw InputError(
        {study.file.string(), "specimen",
         fmt::format("its pressure-volume curve ends before {} mL: {}", to_mL, curve.last.describe()),
         "Check it with `diastole pv`; another mesh may help."});
  }
  for (const PressureVolumePoint& point : curve.points)
    points.push_back({point.volume_change_mL, point.pressure_kPa, point.stiffness_kPa_per_mL});
}

/// What a cylinder's curve depends on; another version of the equations makes kept ones old. Other specimens' curves are
/// not kept.
std::optional<std::string> key_of(const Study& study, const SpecimenResolution& resolution, size_t stride) {
  constexpr int version = 1;
  const auto* annulus = std::get_if<AnnulusSpecimen>(&study.specimen);
  const bool is_plain = !study.chamber && !study.compression.bulk_modulus_kPa &&
                        study.compression.volume_stiffness_kPa == 0.0 && study.refine == std::array<int, 3>{};
  if (annulus == nullptr || !is_plain || study.law.file) return {};
  std::string key =
      fmt::format("{} {} {} {} {} {}", version, annulus->inner_radius_mm, annulus->outer_radius_mm,
                  annulus->height_mm, fmt::join(annulus->mesh, "x"), annulus->ends);
  if (const auto& springs = annulus->end_springs)
    key += fmt::format(" {} {}", springs->normal_kPa_per_mm, springs->tangential_kPa_per_mm);
  key += " " + study.law.name;
  for (const StudyParameter& parameter : study.law.parameters)
    key += fmt::format(" {} {}", parameter.name, parameter.start);
  return key + fmt::format(" {} {} {} {}", resolution.spacing_mL, resolution.points_inflated,
                           resolution.points_emptied, stride);
}

constexpr RecordFormat kept_format{"diastole-curve", "a specimen's curve",
                                   "Delete it: it is computed again."};

std::string file_of(const std::string& key) { return fmt::format("curve-{}.json", fingerprint_of(key)); }

std::optional<SpecimenCurve> kept_curve(const std::string& key) {
  const auto text = read_cached(file_of(key));
  if (!text) return {};
  std::vector<SpecimenCurve::Point> points;
  try {
    kept_format.read(*text, file_of(key), [&](const Json& json) {
      if (json.at("key").get<std::string>() != key) return;
      for (const auto& [volume_mL, pressure_kPa, stiffness] :
           json.at("points").get<std::vector<std::array<double, 3>>>())
        points.push_back({volume_mL, pressure_kPa, stiffness});
    });
  } catch (const InputError&) {  // not whole
    return {};
  }
  if (points.size() < 2) return {};
  return SpecimenCurve(std::move(points));
}

void keep_curve(const std::string& key, const SpecimenCurve& curve) {
  Json points = Json::array();
  for (const SpecimenCurve::Point& at : curve.points())
    points.push_back({at.volume_mL, at.pressure_kPa, at.stiffness_kPa_per_mL});
  write_cached(file_of(key), json_text(kept_format.document({{"key", key}, {"points", points}})) + "\n");
}

}  // namespace

SpecimenFamily::SpecimenFamily(Study study, const SpecimenResolution& resolution)
    : study_(std::move(study)), resolution_(resolution) {
  require_shape_without_load(study_, "pressure-volume curves");
  study_.effects.clear();
  std::vector<StudyParameter>& parameters = study_.law.parameters;
  while (modulus_index_ < parameters.size() && !is_modulus(study_, parameters[modulus_index_]))
    ++modulus_index_;
  if (modulus_index_ == parameters.size()) {
    throw InputError({study_.file.string(), "law",
                      fmt::format("{} has no modulus in kPa that could be sought", study_.law.name),
                      "Use a law with a parameter whose unit is kPa, such as neo-hookean."});
  }
  modulus_kPa_ = parameters[modulus_index_].start;
  if (study_.law.file) {
    solved_at_kPa_ = modulus_kPa_;  // the file's bounds need not hold 1 kPa
    return;
  }
  for (StudyParameter& parameter : parameters)
    if (is_modulus(study_, parameter)) parameter.start /= modulus_kPa_;
}

SpecimenResolution SpecimenResolution::reaching(double volume_mL) const {
  SpecimenResolution wider = *this;
  const auto strides = static_cast<size_t>(std::ceil(volume_mL / (spacing_mL * static_cast<double>(stride))));
  wider.points_inflated = std::max(points_inflated, strides * stride);
  return wider;
}

SpecimenCurve SpecimenFamily::compute(const Study& study, size_t stride) const {
  const double spacing_mL = resolution_.spacing_mL * static_cast<double>(stride);
  const size_t points_emptied = resolution_.points_emptied / stride;
  std::vector<SpecimenCurve::Point> emptied;
  follow(study, -spacing_mL * static_cast<double>(points_emptied), points_emptied, emptied);
  std::vector<SpecimenCurve::Point> points(emptied.rbegin(), emptied.rend());
  points.pop_back();  // rest, which begins both
  const size_t points_inflated = resolution_.points_inflated / stride;
  follow(study, spacing_mL * static_cast<double>(points_inflated), points_inflated, points);
  for (SpecimenCurve::Point& at : points) {
    at.pressure_kPa /= solved_at_kPa_;
    at.stiffness_kPa_per_mL /= solved_at_kPa_;
  }
  return SpecimenCurve(std::move(points));
}

const StudyParameter& SpecimenFamily::modulus() const { return study_.law.parameters[modulus_index_]; }

bool SpecimenFamily::has_neighbours() const {
  return std::holds_alternative<AnnulusSpecimen>(study_.specimen) && study_.law.name == "neo-hookean";
}

const SpecimenCurve& SpecimenFamily::computed(const std::string& name, const Study& study,
                                              size_t stride) const {
  const auto kept = [&]() -> const SpecimenCurve* {
    const std::scoped_lock lock(keeping_);
    const auto found = curves_.find(name);
    return found == curves_.end() ? nullptr : &found->second;
  };
  if (const SpecimenCurve* curve = kept()) return *curve;
  const std::scoped_lock alone(solving_);
  if (const SpecimenCurve* curve = kept()) return *curve;  // another thread was faster
  const std::optional<std::string> key = key_of(study, resolution_, stride);
  std::optional<SpecimenCurve> curve;
  if (key) curve = kept_curve(*key);
  if (!curve) {
    curve = compute(study, stride);
    if (key) keep_curve(*key, *curve);
  }
  const std::scoped_lock lock(keeping_);
  return curves_.emplace(name, *std::move(curve)).first->second;
}

Study SpecimenFamily::on(const std::array<int, 3>& mesh) const {
  Study study = study_;
  std::get<AnnulusSpecimen>(study.specimen).mesh = mesh;
  return study;
}

SpecimenReach SpecimenFamily::reach(double volume_mL, double pressure_kPa) const {
  const std::scoped_lock alone(solving_);
  const bool is_cylinder = std::holds_alternative<AnnulusSpecimen>(study_.specimen);
  const Study study = is_cylinder ? on(resolution_.coarse) : study_;
  ElasticModel model = make_model(study);
  require_closed_cavity(study, model);
  const size_t stride = resolution_.stride;
  const double compared_mL = resolution_.spacing_mL * static_cast<double>(stride);
  const size_t steps = stride * static_cast<size_t>(std::max(std::ceil(volume_mL / compared_mL), 1.0));
  SpecimenReach reach{.is_end = true};
  size_t points = 0;
  const auto goes_on = [&](const PressureVolumePoint& at) {
    if (at.stiffness_kPa_per_mL <= 0.0) return false;
    if (points++ % stride != 0) return true;
    reach = {.volume_mL = at.volume_change_mL,
             .pressure_kPa = modulus_kPa_ / solved_at_kPa_ * at.pressure_kPa};
    reach.is_end = reach.volume_mL < volume_mL && reach.pressure_kPa < pressure_kPa;  // unless it goes on
    return reach.is_end;
  };
  (void)pressure_volume_curve(model, {.volume_change_mL = resolution_.spacing_mL * static_cast<double>(steps),
                                      .steps = steps,
                                      .judge_stability = false,
                                      .on_point = goes_on});
  return reach;
}

SpecimenCurve SpecimenFamily::combined() const {
  if (!std::holds_alternative<AnnulusSpecimen>(study_.specimen)) return computed("own mesh", study_, 1);
  const SpecimenCurve& coarse = computed("coarse", on(resolution_.coarse), 1);
  if (resolution_.fine == resolution_.coarse) return coarse;
  const SpecimenCurve& solved = computed("fine", on(resolution_.fine), resolution_.stride);
  return coarse.plus(solved.plus(coarse, 1.0, -1.0), 1.0, 1.0);
}

const SpecimenCurve& SpecimenFamily::plain() const {
  {
    const std::scoped_lock lock(keeping_);
    if (plain_) return *plain_;
  }
  SpecimenCurve curve = combined();
  const std::scoped_lock lock(keeping_);
  if (!plain_) plain_ = std::move(curve);
  return *plain_;
}

void SpecimenFamily::compute_ahead() {
  ahead_ = std::jthread([this](const std::stop_token& stop) {
    try {
      (void)plain();
      if (!has_neighbours()) return;
      for (const Difference what : {Difference::inner_radius, Difference::stiffening, Difference::end_slip}) {
        const Neighbours neighbours = of(what);
        for (const double node : neighbours.nodes) {
          if (stop.stop_requested()) return;
          if (node != 0.0) (void)solved(neighbours, node, resolution_.coarse);
        }
      }
    } catch (const std::exception&) {  // whoever asks for the curve gets to know
    }
  });
}

const SpecimenCurve& SpecimenFamily::solved(const Neighbours& of, double node,
                                            const std::array<int, 3>& mesh) const {
  Study study = on(mesh);
  of.change(node, study);
  return computed(fmt::format("{} {} {}", of.name, node, mesh == resolution_.fine), study,
                  resolution_.stride);
}

SpecimenCurve SpecimenFamily::between(const Neighbours& of, double value, bool low_fidelity) const {
  const SpecimenCurve& here = plain();
  const SpecimenCurve& base = computed("coarse", on(resolution_.coarse), 1);
  const auto differing = [&](double node, const std::array<int, 3>& mesh, const SpecimenCurve& from) {
    return solved(of, node, mesh).plus(from, 1.0, -1.0);
  };
  std::optional<SpecimenCurve> sum;
  for (const double node : of.nodes) {
    if (node == 0.0) continue;
    double weight = 1.0;
    for (const double other : of.nodes)
      if (other != node) weight *= (value - other) / (node - other);
    const SpecimenCurve one = differing(node, resolution_.coarse, base);
    sum = sum ? sum->plus(one, 1.0, weight) : one.plus(one, weight, 0.0);
  }
  if (!low_fidelity && of.refined_at != 0.0 && resolution_.fine != resolution_.coarse) {
    const double at_mL = 0.5 * resolution_.spacing_mL * static_cast<double>(resolution_.points_inflated);
    const SpecimenCurve coarse = differing(of.refined_at, resolution_.coarse, base);
    const SpecimenCurve fine = differing(of.refined_at, resolution_.fine, here);
    const double share = sum->at(at_mL).pressure_kPa / coarse.at(at_mL).pressure_kPa;
    sum = sum->plus(fine.plus(coarse, 1.0, -1.0), 1.0, share * (1.0 + still_missing));
  }
  return here.plus(*sum, 1.0, 1.0);
}

SpecimenFamily::Neighbours SpecimenFamily::of(Difference what) {
  switch (what) {
    case Difference::inner_radius:
      return {.name = "radius",
              .nodes = {-0.1, -0.05, 0.0, 0.05, 0.1},
              .refined_at = 0.0,
              .change = [](double node, Study& study) {
                std::get<AnnulusSpecimen>(study.specimen).inner_radius_mm *= 1.0 + node;
              }};
    case Difference::stiffening:
      return {.name = "beta",
              .nodes = {0.0, 0.75, 1.5, 3.0},
              .refined_at = 1.5,
              .change = [](double node, Study& study) {
                StudyParameter stiffening = study.law.parameters.front();
                stiffening.name = "beta";
                stiffening.start = node;
                stiffening.lower = 0.0;
                stiffening.upper = 10.0;
                study.law.name = "demiray";
                study.law.parameters.push_back(stiffening);
              }};
    case Difference::end_slip:
      break;
  }
  return {.name = "slip",
          .nodes = {0.0, 0.25, 0.5, 0.75},
          .refined_at = 0.5,
          .change = [](double node, Study& study) {
            auto& annulus = std::get<AnnulusSpecimen>(study.specimen);
            annulus.ends = "sprung";
            const double compliance = softest_mm * node / (1.0 - node);
            annulus.end_springs = EndSprings{plate_kPa_per_mm, 1.0 / compliance};
          }};
}

SpecimenCurve SpecimenFamily::neighbour(Difference what, double value, bool low_fidelity) const {
  // In c / (c + c0) the curve is nearly straight from held to free ends.
  const double place = what == Difference::end_slip ? value / (value + softest_mm) : value;
  return between(of(what), place, low_fidelity);
}

}  // namespace diastole::rig
