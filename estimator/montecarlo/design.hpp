#pragma once
// Which change of an experiment would determine its parameters best, before it is done: the Fisher information of each
// frame at the parameters' present values, by the exact sensitivities.
//
//   I_f = J_f' J_f over (values, P_f),  J_f the weighted residuals' derivatives;  P_f adds 1/sigma_f² to its own entry;
//   the information on the values is the sum over frames of I_f with P_f eliminated.
//
// `unload`: the study's shape was imaged under load, and the fit finds the one without (estimator/fit/study_fit.hpp). The pressure of
// the image is then shared by all frames, and is eliminated last, as a frame's is.
//
// Predicted standard errors are those of the joint fit (estimator/fit/fit.hpp) without smoothness. Points of a frame that does not
// exist yet are those of the frame with the highest pressure, carried along by the model.

#include <string>
#include <vector>

#include "estimator/io/measurement.hpp"
#include "estimator/io/study.hpp"

namespace diastole {

struct DesignOption {
  std::string change;              ///< "one more frame at 2.5 kPa"
  std::vector<double> se_percent;  ///< of each parameter, in % of its value; a regional one's mean
  double volume;                   ///< of the confidence region, as a share of the present one (D-optimality)
};

struct DesignStudy {
  std::vector<std::string> parameters;
  std::vector<double> values;
  std::vector<double> se_percent;     ///< now
  std::vector<DesignOption> options;  ///< the one that shrinks the region most first, once ranked

  /// At the study's start values. Throws InputError for data that say nothing about a parameter.
  DesignStudy(const Study& study, std::vector<double> se_percent);
  void rank();
};

/// At the study's start values. Throws InputError without equilibrium there, without loaded points on the specimen, and for data that
/// say nothing about a parameter.
DesignStudy explore_design(const Study& study, const Measurement& measurement, bool unload = false);

}  // namespace diastole
