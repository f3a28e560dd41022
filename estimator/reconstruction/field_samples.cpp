#include "estimator/reconstruction/field_samples.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace diastole {
namespace {

/// The i-th number of van der Corput's sequence in a base: evenly spread over 0..1 (J. Halton 1960).
double radical_inverse(size_t i, size_t base) {
  double value = 0.0, digit = 1.0;
  for (++i; i > 0; i /= base) {
    digit /= static_cast<double>(base);
    value += digit * static_cast<double>(i % base);
  }
  return value;
}

/// The field of the residuals, by which smoothing twice differs from smoothing once.
NodeField residual_field(const FrameField& field) {
  Eigen::VectorXd residuals(static_cast<Eigen::Index>(field.rows.size()));
  for (size_t i = 0; i < field.rows.size(); ++i)
    residuals[static_cast<Eigen::Index>(i)] = field.rows[i].rejected ? 0.0 : field.rows[i].residual;
  const Eigen::VectorXd right_side = field.system->weighted_rows().transpose() * residuals;
  return field.system->forms().space.field_of(field.system->solve(right_side));
}

}  // namespace

double sampled_freedoms(const FrameField& field) {
  return std::max(1.0, static_cast<double>(field.used()) - field.residual_freedom);
}

std::vector<MaterialPoint> spread_points(const FieldForms& forms, size_t count) {
  std::vector<MaterialPoint> points;
  double owed = 0.0;  // what rounding has kept from earlier elements
  size_t number = 0;
  for (size_t e = 0; e < forms.sobolev.element_volume_mm3.size(); ++e) {
    owed += static_cast<double>(count) * forms.sobolev.element_volume_mm3[e] / forms.sobolev.volume_mm3;
    const auto here = static_cast<size_t>(std::max(1.0, std::round(owed)));
    owed -= static_cast<double>(here);
    for (size_t i = 0; i < here; ++i, ++number)
      points.push_back(
          {e, {radical_inverse(number, 2), radical_inverse(number, 3), radical_inverse(number, 5)}});
  }
  return points;
}

SampledFrame sample_field(const FrameField& field, std::span<const MaterialPoint> points) {
  const HermiteMesh& mesh = field.system->forms().space.mesh();
  std::vector<Functional> functionals;
  for (const MaterialPoint& point : points) {
    for (int k = 0; k < 3; ++k)
      functionals.push_back(displacement_along(mesh, point, Eigen::Vector3d::Unit(k)));
  }
  const std::vector<double> variances = field.system->variances(functionals);
  const NodeField more_mm = residual_field(field);
  SampledFrame sampled;
  sampled.sigma_factor =
      std::sqrt(std::max(1.0, static_cast<double>(functionals.size()) / sampled_freedoms(field)));
  // A sigma that the residuals do not bear out is corrected.
  const double scale = std::max(field.scale, 1e-6);
  double squares = 0.0;
  for (size_t i = 0; i < points.size(); ++i) {
    const double se_mm =
        scale * std::sqrt((variances[3 * i] + variances[3 * i + 1] + variances[3 * i + 2]) / 3.0);
    squares += se_mm * se_mm;
    const Eigen::Vector3d X = mesh.value(mesh.reference(), points[i]);
    const Eigen::Vector3d x = mesh.value(field.position_mm, points[i]) + mesh.value(more_mm, points[i]);
    sampled.points.push_back(
        {field.number, {X[0], X[1], X[2]}, {x[0], x[1], x[2]}, sampled.sigma_factor * se_mm});
  }
  sampled.mean_se_mm = std::sqrt(squares / static_cast<double>(std::max<size_t>(points.size(), 1)));
  return sampled;
}

std::string points_csv(std::span<const SampledFrame> frames) {
  std::string text = "frame,X_mm,Y_mm,Z_mm,x_mm,y_mm,z_mm,sigma_mm\n";
  for (const SampledFrame& frame : frames) {
    for (const ObservedPoint& point : frame.points) {
      fmt::format_to(std::back_inserter(text), "{},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.5f}\n",
                     point.frame, point.X_mm[0], point.X_mm[1], point.X_mm[2], point.x_mm[0], point.x_mm[1],
                     point.x_mm[2], point.sigma_mm);
    }
  }
  return text;
}

}  // namespace diastole
