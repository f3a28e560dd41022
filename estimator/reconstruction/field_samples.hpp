#pragma once
// A field sampled at points, for `NAME.points.csv`, with standard errors that a fit may trust.
//
// A smoothed field is biased: it moves less where motion is sharp. The points are of the field smoothed twice (J. W. Tukey's
// twicing), u + H⁻¹Gᵀ r with the residuals r, of which only the square of that bias is left. Its noise is at most 1.19 times
// the posterior variance that is stated.
//
// Points of a smooth field are not independent: however many are taken, they know no more than the field's effective
// degrees of freedom f = tr(2K - K²), while a fit counts each of their 3 K components as a measurement of its own. So
//
//   sigma = se · sqrt(max(1, 3 K / f))        se: RMS of the standard errors of the point's three components
//
// and as many points as the field has freedoms (f / 3 of them) need no such factor: that is the default.

#include "estimator/reconstruction/frame_field.hpp"

namespace diastole {

/// tr(2K - K²) of the field smoothed twice.
double sampled_freedoms(const FrameField& field);

/// `count` points spread evenly over the body's volume: each element has a share and a Halton sequence of its own,
/// and at least one point.
std::vector<MaterialPoint> spread_points(const FieldForms& forms, size_t count);

struct SampledFrame {
  std::vector<ObservedPoint> points;
  double mean_se_mm = 0.0;    ///< RMS over the points
  double sigma_factor = 1.0;  ///< sigma / se
};

SampledFrame sample_field(const FrameField& field, std::span<const MaterialPoint> points);

/// The text of a `NAME.points.csv`.
std::string points_csv(std::span<const SampledFrame> frames);

}  // namespace diastole
