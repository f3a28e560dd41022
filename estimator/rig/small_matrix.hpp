#pragma once
// A matrix of some ten rows that is multiplied with vectors some hundred thousand times a second.

#include <Eigen/Dense>

namespace diastole::rig {

/// Rows are kept by columns and filled up with zeros to a multiple of eight, and so must be what products are written to.
class SmallMatrix {
 public:
  SmallMatrix() = default;
  explicit SmallMatrix(const Eigen::MatrixXd& matrix);

  static Eigen::Index padded(Eigen::Index rows) { return (rows + 7) / 8 * 8; }
  /// out = this in; `in` may be longer than there are columns.
  void times(const Eigen::VectorXd& in, Eigen::VectorXd& out) const {
    multiply(in.data(), out.data(), false);
  }
  /// out += this in.
  void add_times(const Eigen::VectorXd& in, Eigen::VectorXd& out) const {
    multiply(in.data(), out.data(), true);
  }
  /// out = this in[from, ...).
  void times_from(const Eigen::VectorXd& in, Eigen::Index from, Eigen::VectorXd& out) const {
    multiply(in.data() + from, out.data(), false);
  }

 private:
  void multiply(const double* in, double* out, bool add) const;
  Eigen::MatrixXd values_;
};

}  // namespace diastole::rig
