#pragma once
// The wall of one phase between apex and base plane as a map: side -1/2 (endocardium) to 1/2 (epicardium), theta around,
// s from the apex (0) to the base plane (1) along each meridian, in equal parts of mu.

#include <Eigen/Dense>

#include "estimator/imaging/geometry/prolate_frame.hpp"
#include "estimator/imaging/geometry/ventricle_fit.hpp"

namespace diastole::imaging {

class WallMap {
 public:
  /// The two must outlive the map.
  WallMap(const ProlateFrame& frame, const VentricleWalls& walls);

  /// mu where the wall meets the base plane. Throws std::domain_error if it does not.
  [[nodiscard]] double base_mu(double side, double theta) const;
  [[nodiscard]] Prolate at(double side, double theta, double mu) const;
  /// In the frame's axes.
  [[nodiscard]] Eigen::Vector3d place_mm(double side, double theta, double mu) const {
    return frame_.place(at(side, theta, mu));
  }
  /// Along the wall's normal, positive outside. `inside_mm` in the frame's axes.
  [[nodiscard]] double distance_mm(double side, const Eigen::Vector3d& inside_mm) const;
  /// Standard deviation of the wall's place along its normal.
  [[nodiscard]] double sigma_mm(double side, double theta, double mu) const;
  /// From the endocardium along the normal of the middle of the wall.
  [[nodiscard]] double thickness_mm(double theta, double s) const;
  /// Standard deviation of the volume behind the endocardium, of wall and base plane.
  [[nodiscard]] double cavity_sigma_mL() const;

 private:
  [[nodiscard]] Eigen::VectorXd coefficients(double side) const {
    return walls_.middle + side * walls_.thickness;
  }

  const ProlateFrame& frame_;
  const VentricleWalls& walls_;
  int degree_;
};

}  // namespace diastole::imaging
