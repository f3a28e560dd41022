#include "estimator/explain/imaging/field_case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimator/io/study_refusal.hpp"
#include "estimator/model/affected_model.hpp"

namespace diastole::explain {
namespace {

/// Half the bounds' width over their middle up to which they are a measurement.
constexpr double narrow = 0.05;

}  // namespace

std::optional<Measured> seen_inner_radius(const Measurement& measurement, double outer_radius_mm) {
  constexpr size_t enough = 200;
  constexpr double trusted_mm = 0.3;
  std::vector<double> radii_mm;
  for (const TagPoint& tag : measurement.tags) {
    if (tag.frame != 0) continue;
    double error_mm = -tag.plane_mm;
    for (size_t i = 0; i < 3; ++i)
      error_mm += tag.normal[i] * tag.x_mm[i];
    radii_mm.push_back(
        std::hypot(tag.x_mm[0] - error_mm * tag.normal[0], tag.x_mm[1] - error_mm * tag.normal[1]));
  }
  if (radii_mm.size() < enough) return {};
  const auto [inner, outer] = std::minmax_element(radii_mm.begin(), radii_mm.end());
  const double margin_mm = outer_radius_mm - *outer;
  if (margin_mm < 0.0) return {};
  return Measured{*inner - margin_mm, trusted_mm};
}

FieldCase field_case(const Study& study) {
  const auto& annulus = std::get<AnnulusSpecimen>(study.specimen);
  require_shape_without_load(study, "field effects");
  if (study.law.parameters.front().vary == Variation::element)
    refuse(study, "law.parameters.C1_kPa.vary",
           "images are explained from a gel of one stiffness, not of one value an element",
           "Set vary = \"whole\": an inclusion is then found by name, and a stiffness that varies smoothly "
           "is told as something outside the library. `diastole fit` maps one value an element.");
  if (!study.data.tags && !study.data.points)
    refuse(study, "data", "the study has neither tags nor points",
           "Name a tags or points file and its frames.");
  FieldCase field;
  field.base = field_model_of(study);
  field.measurement = read_measurement(study);
  for (size_t frame = 1; frame < field.measurement.frames.size(); ++frame) {
    const double pressure_kPa = field.measurement.frames[frame].pressure_kPa;
    if (pressure_kPa <= 0.0)
      refuse(study, "data.frames", fmt::format("frame {} has a pressure of {:g} kPa", frame, pressure_kPa),
             "Frames after the first must be inflated; leave others out.");
  }
  const StudyParameter& C1 = study.law.parameters.front();
  field.C1_start_kPa.value = C1.start;
  field.C1_bounds_kPa = {C1.lower, C1.upper};
  const double half_width_kPa = 0.5 * (C1.upper - C1.lower);
  if (half_width_kPa < narrow * 0.5 * (C1.upper + C1.lower)) {
    field.C1_start_kPa = {0.5 * (C1.upper + C1.lower), 0.5 * half_width_kPa};
    field.C1_bounds_kPa = {0.2 * C1.start, 5.0 * C1.start};
  }
  field.inner_radius_mm = seen_inner_radius(field.measurement, annulus.outer_radius_mm);
  return field;
}

}  // namespace diastole::explain
