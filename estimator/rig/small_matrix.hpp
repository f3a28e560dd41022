#pragma once
// A matrix of some ten rows that is multiplied with vectors some hundred thousand times a second.

#include <Eigen/Dense>
#include <array>
#include <vector>

namespace diastole::rig {

/// Rows are kept by columns and filled up with zeros to a multiple of eight, and so must be what products are written to.
class SmallMatrix {
 public:
  SmallMatrix() = default;
  explicit SmallMatrix(const Eigen::MatrixXd& matrix);

  static Eigen::Index padded(Eigen::Index rows) { return (rows + 7) / 8 * 8; }
  /// out = this in; `in` may be longer than there are columns.
  void times(const Eigen::VectorXd& in, Eigen::VectorXd& out) const {
    multiply(nullptr, in.data(), out.data());
  }
  /// out = before + this in; `before` may be `out`. Setting `out` to it first and adding would wait for what was just written.
  void add_times(const Eigen::VectorXd& before, const Eigen::VectorXd& in, Eigen::VectorXd& out) const {
    multiply(before.data(), in.data(), out.data());
  }
  /// out = this in[from, ...).
  void times_from(const Eigen::VectorXd& in, Eigen::Index from, Eigen::VectorXd& out) const {
    multiply(nullptr, in.data() + from, out.data());
  }

 private:
  /// Eight rows of a column, in one line of the cache.
  struct alignas(64) Stretch {
    std::array<double, 8> values{};
  };
  void multiply(const double* before, const double* in, double* out) const;

  std::vector<Stretch> values_;
  size_t rows_ = 0, columns_ = 0;
};

}  // namespace diastole::rig
