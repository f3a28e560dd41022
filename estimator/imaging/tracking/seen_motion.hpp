#pragma once
// The motion at places where a person saw a tag.

#include <Eigen/Core>
#include <vector>

#include "estimator/imaging/tracking/phase_information.hpp"
#include "estimator/imaging/tracking/tag_view.hpp"

namespace diastole::imaging {

class SeenMotion {
 public:
  /// `waves`: the tags at rest.
  SeenMotion(const TagView& view, const std::vector<TagWave>& waves, const SplinePlane& splines);

  /// Whether a person saw a tag in the phase.
  [[nodiscard]] bool is_led(size_t phase) const;
  [[nodiscard]] bool is_led(size_t phase, size_t direction) const { return !seen_[phase][direction].empty(); }
  /// On the coefficients of the direction's motion.
  [[nodiscard]] PhaseInformation information(size_t phase, size_t direction) const;
  /// Minus the log likelihood of these coefficients.
  [[nodiscard]] double cost(size_t phase, size_t direction,
                            const Eigen::Ref<const Eigen::VectorXd>& coefficients) const;

 private:
  struct Place {
    SplineValues splines;
    double w_mm;
  };
  double sigma_mm_;
  int splines_;
  std::vector<std::vector<std::vector<Place>>> seen_;  // a phase and direction
};

}  // namespace diastole::imaging
