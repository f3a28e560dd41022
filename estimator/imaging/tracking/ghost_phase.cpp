#include "estimator/imaging/tracking/ghost_phase.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "estimator/imaging/tracking/brightness.hpp"
#include "estimator/imaging/tracking/robust_weight.hpp"

namespace diastole::imaging {
namespace {

constexpr size_t quadrants = 4;
/// Residuals of twice the noise's variance over a circle of a spacing are a fold or an edge, and no ghost: it is weaker than noise.
constexpr double most_around = 2.0;

/// Of the noise's variance in a channel what the magnitude has where there is nothing but noise (Rayleigh).
constexpr double dark_variance = 2 - std::numbers::pi / 2;

/// A pixel that was fitted.
struct Over {
  Eigen::Index row, column;
  std::array<double, 2> phases_rad;
  SplineValues splines;
  double ghost;           // the shifted picture, then what is left of it
  double image;           // and of the image
  double ghost_variance;  // of the noise in the shifted picture
};

/// Pixels within `reach_mm` of one around which the residuals are too large.
PixelMask corrupted_pixels(const TagView& view, const TrackedPhase& phase, double reach_mm) {
  const auto rows = static_cast<Eigen::Index>(reach_mm / view.plane.row_spacing_mm);
  const auto columns = static_cast<Eigen::Index>(reach_mm / view.plane.column_spacing_mm);
  const auto around = [&](auto& map, Eigen::Index row, Eigen::Index column) {
    const Eigen::Index top = std::max<Eigen::Index>(0, row - rows);
    const Eigen::Index left = std::max<Eigen::Index>(0, column - columns);
    return map.block(top, left, std::min(row + rows + 1, map.rows()) - top,
                     std::min(column + columns + 1, map.cols()) - left);
  };
  PixelMask large = PixelMask::Constant(phase.residual.rows(), phase.residual.cols(), false);
  for (Eigen::Index column = 0; column < large.cols(); ++column) {
    for (Eigen::Index row = 0; row < large.rows(); ++row) {
      if (phase.residual(row, column) == 0) continue;
      const auto near = around(phase.residual, row, column);
      large(row, column) = static_cast<double>(near.square().sum()) >
                           most_around * phase.noise * phase.noise * static_cast<double>((near != 0).count());
    }
  }
  PixelMask corrupted = large;
  for (Eigen::Index column = 0; column < large.cols(); ++column) {
    for (Eigen::Index row = 0; row < large.rows(); ++row) {
      if (large(row, column)) around(corrupted, row, column) = true;
    }
  }
  return corrupted;
}

std::vector<Over> fitted_pixels(const TagView& view, const TrackedView& tracked, size_t k,
                                const Ghost& ghost) {
  const TrackedPhase& phase = tracked.phases[k];
  const PixelMask corrupted = corrupted_pixels(view, phase, tracked.waves[0].spacing_mm());
  const Image variance = phase.materials.unaryExpr([&](Material material) {
    return static_cast<float>(phase.noise * phase.noise *
                              (material == Material::nothing ? dark_variance : 1));
  });
  std::vector<Over> pixels;
  for (Eigen::Index column = 0; column < phase.residual.cols(); ++column) {
    for (Eigen::Index row = 0; row < phase.residual.rows(); ++row) {
      if (phase.residual(row, column) == 0 || corrupted(row, column)) continue;
      const Eigen::Vector2d x_mm = view.place_mm(row, column);
      Over pixel{row,
                 column,
                 {},
                 tracked.motion[0].splines.at(x_mm),
                 ghost.over(view.images[k], row, column) / ghost.share,
                 static_cast<double>(view.images[k](row, column)),
                 ghost.over(variance, row, column) / ghost.share};
      for (size_t f = 0; f < tracked.waves.size(); ++f) {
        const TagWave& wave = tracked.waves[f];
        pixel.phases_rad[f] =
            2 * std::numbers::pi *
            (wave.per_mm.dot(x_mm) - wave.offset_cycles +
             wave.per_mm.norm() *
                 spline_sum(pixel.splines, tracked.motion[f].coefficients.col(static_cast<Eigen::Index>(k))));
      }
      pixels.push_back(pixel);
    }
  }
  return pixels;
}

/// Takes off a picture what smooth brightness explains.
void take_off_brightness(const TagView& view, const TagModel& model, double spacing_mm,
                         std::vector<Over>& pixels, double Over::*picture) {
  Brightness brightness(view.extent_mm(), spacing_mm, static_cast<int>(model.patterns()));
  const auto phases = [&](const Over& pixel) {
    return std::span(pixel.phases_rad).first(model.directions());
  };
  for (const Over& pixel : pixels)
    brightness.add(view.place_mm(pixel.row, pixel.column), model.at(phases(pixel)).values(), 1.0,
                   pixel.*picture);
  brightness.solve(Brightness::Places::added);
  std::array<double, TagPatterns::most> amplitudes{};
  for (Over& pixel : pixels) {
    const TagPatterns patterns = model.at(phases(pixel));
    brightness.at(view.place_mm(pixel.row, pixel.column), std::span(amplitudes).first(patterns.count));
    for (size_t j = 0; j < patterns.count; ++j)
      pixel.*picture -= amplitudes[j] * patterns.value[j];
  }
}

/// Takes off both what a motion of one direction's tags explains.
void take_off_motion(const SplinePlane& splines, const Eigen::ArrayXXf& slope, std::vector<Over>& pixels) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(splines.count(), splines.count());
  Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(splines.count(), 2);
  for (const Over& pixel : pixels) {
    const double here = static_cast<double>(slope(pixel.row, pixel.column));
    const SplineValues& at = pixel.splines;
    for (size_t i = 0; i < 16; ++i) {
      if (at.index[i] < 0) continue;
      right.row(at.index[i]) += here * at.value(i) * Eigen::RowVector2d(pixel.ghost, pixel.image);
      for (size_t j = 0; j < 16; ++j) {
        if (at.index[j] >= 0) matrix(at.index[i], at.index[j]) += here * here * at.value(i) * at.value(j);
      }
    }
  }
  // Splines that the pixels hardly touch stay where they are.
  matrix.diagonal().array() += 1e-3 * matrix.diagonal().mean() + 1e-300;
  const Eigen::MatrixX2d motion = matrix.llt().solve(right);
  for (Over& pixel : pixels) {
    const double here = static_cast<double>(slope(pixel.row, pixel.column));
    pixel.ghost -= here * spline_sum(pixel.splines, motion.col(0));
    pixel.image -= here * spline_sum(pixel.splines, motion.col(1));
  }
}

/// An estimate, and its variance.
struct Say {
  double share, variance;
};
using Says = std::array<std::vector<Say>, quadrants>;  // of each phase

struct Pooled {
  double mean = 0, variance = 0;
  double spread = 0;  ///< how much more than their variances the estimates differ
};

/// The weighted mean; estimates may differ by more than their variances (DerSimonian, Laird, Control. Clin. Trials 7 (1986) 177).
Pooled pooled(const std::vector<Say>& says) {
  double weight = 0, sum = 0, squares = 0, spread = 0;
  for (const Say& say : says) {
    weight += 1 / say.variance;
    sum += say.share / say.variance;
    squares += 1 / (say.variance * say.variance);
  }
  for (const Say& say : says)
    spread += (say.share - sum / weight) * (say.share - sum / weight) / say.variance;
  Pooled all;
  const double freedom = static_cast<double>(says.size()) - 1;
  if (freedom > 0) all.spread = std::max(0.0, (spread - freedom) / (weight - squares / weight));
  double inverse = 0;
  for (const Say& say : says) {
    inverse += 1 / (say.variance + all.spread);
    all.mean += say.share / (say.variance + all.spread);
  }
  all.mean /= inverse;
  all.variance = 1 / inverse;
  return all;
}

void add_says(const TagView& view, const TrackedView& tracked, size_t k, const Ghost& ghost, Says& says) {
  std::vector<Over> pixels = fitted_pixels(view, tracked, k, ghost);
  if (pixels.empty()) return;
  const double spacing_mm = tracked.waves[0].spacing_mm();
  const double noise = tracked.phases[k].noise;
  const TagModel model(tracked.waves.size());
  for (const auto picture : {&Over::ghost, &Over::image})
    take_off_brightness(view, model, spacing_mm, pixels, picture);
  for (size_t f = 0; f < tracked.waves.size(); ++f)
    take_off_motion(tracked.motion[f].splines, tracked.phases[k].slope[f], pixels);
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Over& pixel : pixels)
    middle += view.place_mm(pixel.row, pixel.column) / static_cast<double>(pixels.size());
  std::array<double, quadrants> squares{}, products{}, noises{};
  for (const Over& pixel : pixels) {
    const Eigen::Vector2d x_mm = view.place_mm(pixel.row, pixel.column);
    const size_t quadrant = (x_mm.x() > middle.x() ? 1U : 0U) + (x_mm.y() > middle.y() ? 2U : 0U);
    // The shifted picture has noise of its own, which is none of the ghost's edges.
    squares[quadrant] += pixel.ghost * pixel.ghost;
    noises[quadrant] += pixel.ghost_variance;
    products[quadrant] += huber_weight(pixel.image, noise) * pixel.image * pixel.ghost;
  }
  for (size_t quadrant = 0; quadrant < quadrants; ++quadrant) {
    const double edges = squares[quadrant] - noises[quadrant];
    if (edges > 0)
      says[quadrant].push_back(
          {products[quadrant] / edges, noise * noise * squares[quadrant] / (edges * edges)});
  }
}

}  // namespace

void measure_in_phase(const TagView& view, const TrackedView& tracked, Ghost& ghost) {
  Says says;
  for (size_t k = 0; k < view.images.size(); ++k)
    add_says(view, tracked, k, ghost, says);
  std::vector<Say> each;
  for (const std::vector<Say>& quadrant : says) {
    if (quadrant.size() < 2) continue;
    const Pooled phases = pooled(quadrant);
    each.push_back({phases.mean, phases.variance});
  }
  if (each.size() < 2) return;
  const Pooled all = pooled(each);
  const double mean = std::clamp(all.mean, -ghost.share, ghost.share);
  const double variance = all.variance + all.spread;
  // The phase may be any at first.
  double likely = 0, first = 0, second = 0;
  constexpr int steps = 360;
  for (int step = 0; step < steps; ++step) {
    const double in_phase = ghost.share * std::cos(std::numbers::pi * (step + 0.5) / steps);
    const double weight_here = std::exp(-0.5 * (in_phase - mean) * (in_phase - mean) / variance);
    likely += weight_here;
    first += weight_here * in_phase;
    second += weight_here * in_phase * in_phase;
  }
  ghost.in_phase = first / likely;
  ghost.in_phase_sigma = std::sqrt(std::max(0.0, second / likely - ghost.in_phase * ghost.in_phase));
}

TagView without_ghosts(const TagView& view, const TrackedView& tracked, const std::vector<Ghost>& ghosts) {
  TagView clean = view;
  for (size_t k = 0; k < view.images.size(); ++k) {
    for (Eigen::Index column = 0; column < view.plane.columns; ++column) {
      for (Eigen::Index row = 0; row < view.plane.rows; ++row) {
        if (tracked.phases[k].materials(row, column) == Material::nothing) continue;
        double across = 0, along = 0;
        for (const Ghost& ghost : ghosts) {
          const double over = ghost.over(view.images[k], row, column) / ghost.share;
          along += over * ghost.in_phase;
          across += over * over * (ghost.share * ghost.share - ghost.in_phase * ghost.in_phase);
        }
        // |s + g|^2 = (s + g cos)^2 + (g sin)^2
        const double seen = static_cast<double>(view.images[k](row, column));
        clean.images[k](row, column) =
            static_cast<float>(std::sqrt(std::max(0.0, seen * seen - across)) - along);
      }
    }
  }
  return clean;
}

}  // namespace diastole::imaging
