#pragma once
// The unknowns of a search, in the order of their coordinates q.

#include <Eigen/Core>
#include <vector>

#include "estimator/inference/parameter.hpp"

namespace diastole::inference {

enum class BoundSide { none, lower, upper };

class ParameterSpace {
 public:
  ParameterSpace() = default;
  explicit ParameterSpace(std::vector<Parameter> parameters);

  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(parameters_.size()); }
  [[nodiscard]] const Parameter& operator[](Eigen::Index i) const {
    return parameters_[static_cast<size_t>(i)];
  }
  /// Bounds of the coordinates.
  [[nodiscard]] const Eigen::VectorXd& lower() const { return lower_; }
  [[nodiscard]] const Eigen::VectorXd& upper() const { return upper_; }
  [[nodiscard]] Eigen::VectorXd clamped(const Eigen::VectorXd& q) const;

  /// The coordinates of values, clamped. Precondition: a value for each parameter.
  [[nodiscard]] Eigen::VectorXd coordinates(const std::vector<double>& values) const;
  [[nodiscard]] std::vector<double> values(const Eigen::VectorXd& q) const;

  /// The bound of the coordinate on which an unknown rests, within 1e-7 of its range; none where it has no range.
  [[nodiscard]] BoundSide bound_under(const Eigen::VectorXd& q, Eigen::Index i) const;
  /// One entry an unknown: whether it rests on no bound.
  [[nodiscard]] std::vector<bool> free_unknowns(const Eigen::VectorXd& q) const;

 private:
  std::vector<Parameter> parameters_;
  Eigen::VectorXd lower_, upper_;
};

}  // namespace diastole::inference
