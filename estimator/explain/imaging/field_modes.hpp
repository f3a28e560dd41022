#pragma once
// Changes of the imaged motion that no effect of the library makes, as columns beside the base model's residuals:
//
//   plates      the top plate moves against the bottom one: along x, y, z, and turns about x, y, z
//   pose        the whole specimen moves or turns in the images
//   body force  it sags along x, y, z
//   stiffness   C1 varies by smooth harmonics  cos/sin(m theta) P_k(z) P_l(r)
//   motion      the displacement itself differs by such harmonics along r, theta, z
//
// Plates, pose and body force come in two courses: in proportion to the load, and constant from the first loaded frame on.
// All but the last two are exact responses of the elastic body. They serve to find structure that is left, to locate
// it, and to rival the library: what a turned plate explains better than any effect does is not that effect.

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/motion_residuals/motion_residuals.hpp"

namespace diastole::explain {

struct FieldMode {
  std::string family;   ///< as above
  std::string name;     ///< in words: "the top plate turns about z, with the load"
  bool smooth = false;  ///< of the lowest order: a rival to an effect
  bool rough = false;   ///< a motion of an order that hardly any effect makes: what is in it is the images'
};

struct FieldModes {
  std::vector<FieldMode> modes;
  Eigen::MatrixXd columns;  ///< over the problem's rows
};

/// Over the rows of a base fit with these pressures, one a slot; the body's equilibrium at the highest of them.
FieldModes field_modes(const MotionResiduals& rows, ElasticModel& body, const ElasticState& state,
                       const std::vector<double>& pressures_kPa);

}  // namespace diastole::explain
