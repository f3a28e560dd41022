#pragma once
// What columns beside a fit would gain: chi2 of the residuals' projection on them, the fit's own unknowns free.
//
// With r the residuals at the optimum, J the fit's Jacobian (priors included) and c a column, C1 and pressures answer to c,
// so that  c' = c - J J^+ c  is what counts, and chi2 falls by  (c' . r)^2 / |c'|^2.

#include <Eigen/Dense>
#include <vector>

#include "estimator/explain/imaging/field_fit.hpp"

namespace diastole::explain {

/// An orthonormal basis of what columns span; columns that others hold already add nothing.
Eigen::MatrixXd orthonormal_basis(const Eigen::MatrixXd& columns);

/// By how much a residual changes with a displacement outwards, around the axis and along z, at its place.
Eigen::RowVector3d by_cylindrical_motion(const ResidualRow& row);

class LinearEvidence {
 public:
  /// `columns` over the fit's rows.
  LinearEvidence(const FieldFit& fit, const Eigen::MatrixXd& columns);

  struct Gain {
    double chi_square = 0.0;
    Eigen::Index degrees = 0;
  };
  /// Of all the chosen columns together; columns that the others hold already are not counted.
  [[nodiscard]] Gain gain(const std::vector<Eigen::Index>& chosen) const;
  [[nodiscard]] double gain(Eigen::Index column) const;
  /// Square of a column, without what the fit's own unknowns make of it.
  [[nodiscard]] double size(Eigen::Index column) const { return normal_(column, column); }
  /// The amount of a column that the residuals ask for.
  [[nodiscard]] double amount(Eigen::Index column) const;

  struct Choice {
    std::vector<Eigen::Index> columns;
    double score = 0.0;  ///< gain - 2 a column - 2 log(number to choose from) for each choice
    double chi_square = 0.0;
  };
  /// Up to three columns, one after the other, that gain most.
  [[nodiscard]] Choice best_of(const std::vector<Eigen::Index>& candidates) const;

 private:
  Eigen::MatrixXd normal_;    // of the projected columns
  Eigen::VectorXd gradient_;  // their products with the residuals
};

}  // namespace diastole::explain
