#pragma once
// One image explained by its tissue's brightness and a motion of its tags: what steps 2 and 3 of tag_tracker.hpp do in one phase.

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "estimator/imaging/tracking/phase_information.hpp"
#include "estimator/imaging/tracking/residual_excess.hpp"
#include "estimator/imaging/tracking/tag_model.hpp"
#include "estimator/imaging/tracking/tag_view.hpp"

namespace diastole::imaging {

/// A pixel that tissue may reach in the cycle.
struct TissuePixel {
  Eigen::Index row, column;
  Eigen::Vector2d x_mm;
  SplineValues splines;
};

/// The motion of all phases: coefficients of the splines, n x T, one a direction.
using SliceMotion = std::vector<Eigen::MatrixXd>;

class ImageFit {
 public:
  /// `view`, `waves` (the tags at rest) and `pixels` outlive it.
  ImageFit(const TagView& view, const std::vector<TagWave>& waves, const std::vector<TissuePixel>& pixels)
      : view_(view), waves_(waves), pixels_(pixels), model_(waves.size()) {}

  /// The tags' patterns at a pixel in phase k.
  [[nodiscard]] TagPatterns patterns_at(const TissuePixel& pixel, size_t k, const SliceMotion& motion) const;

  /// Fits the brightness of an image of phase k at this motion, over the pixels that are surely tissue by the phase's depth. Residuals, slopes and
  /// noise are written to `phase`; what follows is of the image explained last.
  void explain(size_t k, const Image& image, const SliceMotion& motion, TrackedPhase& phase);

  /// Minus the log likelihood, with Huber's loss.
  [[nodiscard]] double cost(double noise) const;

  /// Gradient (in place of eta) and curvature of one direction's motion, at the motion that the image was explained with. `phase`: what `explain`
  /// wrote; `splines`: how many there are.
  [[nodiscard]] PhaseInformation information(const TrackedPhase& phase, const ResidualExcess& excess,
                                             size_t direction, int splines) const;

 private:
  struct Fitted {
    const TissuePixel* pixel;
    std::array<double, 2> phases;
    TagPatterns patterns;
    double residual;
    std::array<double, 2> slope;  // a direction
  };

  [[nodiscard]] std::array<double, 2> phases_at(const TissuePixel& pixel, size_t k,
                                                const SliceMotion& motion) const;

  const TagView& view_;
  const std::vector<TagWave>& waves_;
  const std::vector<TissuePixel>& pixels_;
  TagModel model_;
  std::vector<Fitted> fitted_;
};

}  // namespace diastole::imaging
