#pragma once
// What a learned curve looks like: the simplest formula that its band admits, words for a person, and the effect file.

#include <Eigen/Dense>

#include "estimator/explain/rig/port_law.hpp"
#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::explain {

/// What the data say of a curve's values at its knots, all other unknowns at their best: chi-square is values' precision
/// values - 2 slope' values, and a constant.
struct CurveEvidence {
  Eigen::MatrixXd precision;
  Eigen::VectorXd slope;
};

/// Sets closed_form, readings and toml of a term with a curve and its band.
///
/// Formulas are tried from the simplest on: none, a line, a square, saturation, a threshold, one side alone. One is taken if the data
/// bear it: if it lies within the band at every knot, and its chi-square is no further above the curve's than one true curve in ten
/// is (a band is wide, too, where only the specimen's stiffness takes the curve's part). Its first parameter is the curve's size, the
/// second where it bends. `text` holds the file's id, what it was learnt from and what looks alike.
void read_law(const PortLaw& law, const CurveEvidence& evidence, LearnedTerm& term, LawText text = {});

}  // namespace diastole::explain
