#include "estimator/imaging/series/tag_waves.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include "estimator/imaging/series/spectrum.hpp"
#include "protocol/signal/median.hpp"

namespace diastole::imaging {
namespace {

/// The spectrum of noise is exponentially distributed: its largest of 10^5 values is 12 times the mean, 17 times the median.
constexpr double least_prominence = 50.0;
/// Tags of a tenth of full modulation are gone from sight in noise of a twentieth of the signal.
constexpr double least_modulation = 0.1;
/// A spacing needs two pixels to be seen at all, and some more to be distinguished from its mirror image.
constexpr double least_pixels_a_period = 2.5;
/// Fewer periods than this across the image are shading or the object itself.
constexpr double least_periods = 6.0;
/// Two directions of a grid are made by one pulse train each, of equal strength; sums and differences have half of that.
constexpr double least_share_of_strongest = 0.6;

Image hann_windowed(const Image& image) {
  const auto window = [](Eigen::Index count) -> Eigen::ArrayXf {
    return Eigen::ArrayXf::NullaryExpr(count, [count](Eigen::Index i) {
      const double turn =
          2.0 * std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(count);
      return static_cast<float>(0.5 - 0.5 * std::cos(turn));
    });
  };
  return image * (window(image.rows()).matrix() * window(image.cols()).matrix().transpose()).array();
}

/// The windowed image's transform at any k, by its definition.
std::complex<double> transform_at(const Image& windowed, const SlicePlane& plane,
                                  const Eigen::Vector2d& per_mm) {
  const auto turns = [](double k, double spacing_mm, Eigen::Index count) -> Eigen::ArrayXcd {
    return Eigen::ArrayXcd::NullaryExpr(count, [=](Eigen::Index i) {
      return std::polar(1.0, -2.0 * std::numbers::pi * k * spacing_mm * static_cast<double>(i));
    });
  };
  const Eigen::ArrayXcd along_columns = turns(per_mm.y(), plane.row_spacing_mm, windowed.rows());
  const Eigen::ArrayXcd along_rows = turns(per_mm.x(), plane.column_spacing_mm, windowed.cols());
  return along_columns.matrix().transpose() * windowed.cast<std::complex<double>>().matrix() *
         along_rows.matrix();
}

/// Climbs |F| from a bin to its maximum between the bins by ever smaller steps.
Eigen::Vector2d climb(const Image& windowed, const SlicePlane& plane, Eigen::Vector2d per_mm,
                      const Eigen::Vector2d& bin) {
  double best = std::abs(transform_at(windowed, plane, per_mm));
  for (double step = 0.5; step > 0.002; step *= 0.5) {
    for (bool moved = true; moved;) {
      moved = false;
      for (const Eigen::Vector2d& way :
           {Eigen::Vector2d(1, 0), Eigen::Vector2d(-1, 0), Eigen::Vector2d(0, 1), Eigen::Vector2d(0, -1)}) {
        const Eigen::Vector2d trial = per_mm + step * way.cwiseProduct(bin);
        const double height = std::abs(transform_at(windowed, plane, trial));
        if (height <= best) continue;
        best = height;
        per_mm = trial;
        moved = true;
      }
    }
  }
  return per_mm;
}

struct Peak {
  Eigen::Vector2d per_mm;
  double power;
  double prominence;
};

/// Local maxima of the half plane x > 0 that stand out of the power at their own |k|, strongest first.
std::vector<Peak> peaks(const Eigen::ArrayXXcf& spectrum, const SlicePlane& plane) {
  const Eigen::Vector2d extent(plane.column_spacing_mm * plane.columns, plane.row_spacing_mm * plane.rows);
  const double highest = 1.0 / (least_pixels_a_period * plane.finer_spacing_mm());
  const double lowest = least_periods / extent.minCoeff();
  const double ring_width = 2.0 / extent.minCoeff();
  std::vector<std::vector<float>> rings(static_cast<size_t>(highest / ring_width) + 2);
  std::vector<Peak> candidates;
  const Eigen::Index rows = spectrum.rows();
  const Eigen::Index columns = spectrum.cols();
  const Eigen::ArrayXXf power = spectrum.abs2();
  for (Eigen::Index column = 0; column < columns; ++column) {
    for (Eigen::Index row = 0; row < rows; ++row) {
      const Eigen::Vector2d k(signed_bin(column, columns) / extent.x(), signed_bin(row, rows) / extent.y());
      const double length = k.norm();
      if (length < lowest || length > highest) continue;
      rings[static_cast<size_t>(length / ring_width)].push_back(power(row, column));
      if (k.x() < -1e-9 || (std::abs(k.x()) <= 1e-9 && k.y() < 0)) continue;
      bool is_top = true;
      for (Eigen::Index dc = -1; dc <= 1; ++dc) {
        for (Eigen::Index dr = -1; dr <= 1; ++dr)
          is_top = is_top &&
                   power(row, column) >= power((row + dr + rows) % rows, (column + dc + columns) % columns);
      }
      if (is_top) candidates.push_back({k, static_cast<double>(power(row, column)), 0});
    }
  }
  std::vector<double> medians;
  for (auto& ring : rings)
    medians.push_back(ring.empty() ? 0.0 : static_cast<double>(signal::median(std::move(ring))));
  std::vector<Peak> found;
  for (Peak& peak : candidates) {
    peak.prominence =
        peak.power / std::max(medians[static_cast<size_t>(peak.per_mm.norm() / ring_width)], 1e-30);
    if (peak.prominence >= least_prominence) found.push_back(peak);
  }
  std::sort(found.begin(), found.end(), [](const Peak& a, const Peak& b) { return a.power > b.power; });
  return found;
}

/// Within 20 degrees of a direction that is known already: the same stripes, a harmonic, or their window's side lobes.
bool same_direction(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return std::abs(a.dot(b)) > 0.94 * a.norm() * b.norm();
}

}  // namespace

double modulation_at(const Image& image, const SlicePlane& plane, const Eigen::Vector2d& per_mm) {
  const Image windowed = hann_windowed(image);
  const double sum = static_cast<double>(windowed.cast<double>().sum());
  return sum > 0 ? 2.0 * std::abs(transform_at(windowed, plane, per_mm)) / sum : 0.0;
}

std::vector<TagWave> find_tag_waves(const Image& image, const SlicePlane& plane) {
  const Image windowed = hann_windowed(image);
  const double sum = windowed.cast<double>().sum();
  if (!(sum > 0)) return {};
  const Eigen::Vector2d bin(1.0 / (plane.column_spacing_mm * plane.columns),
                            1.0 / (plane.row_spacing_mm * plane.rows));
  std::vector<TagWave> waves;
  for (const Peak& peak : peaks(spectrum_of(windowed), plane)) {
    if (waves.size() == 2) break;
    if (!waves.empty() && same_direction(waves[0].per_mm, peak.per_mm)) continue;
    const Eigen::Vector2d per_mm = climb(windowed, plane, peak.per_mm, bin);
    const std::complex<double> value = transform_at(windowed, plane, per_mm);
    const double modulation = 2.0 * std::abs(value) / sum;
    if (modulation < least_modulation) break;
    if (!waves.empty() && modulation < least_share_of_strongest * waves[0].modulation) break;
    // F(k) of 1 - cos(2 pi (k . x - offset)) has the phase pi - 2 pi offset.
    const double offset = 0.5 - std::arg(value) / (2.0 * std::numbers::pi);
    waves.push_back({per_mm, offset, modulation, peak.prominence});
  }
  return waves;
}

}  // namespace diastole::imaging
