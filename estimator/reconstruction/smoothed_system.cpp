#include "estimator/reconstruction/smoothed_system.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace diastole {
namespace {

constexpr size_t solved_at_once = 128;

}  // namespace

SmoothedSystem::SmoothedSystem(const FieldForms& forms) : forms_(forms), data_(forms.quadratic.zero()) {}

void SmoothedSystem::set_rows(std::span<const ObservationRow> rows) {
  data_ = forms_.quadratic.zero();
  measured_ = static_cast<size_t>(
      std::count_if(rows.begin(), rows.end(), [](const ObservationRow& row) { return row.weight > 0; }));
  blocks_.assign(forms_.space.mesh().element_count(), {});
  for (size_t i = 0; i < rows.size(); ++i)
    blocks_[rows[i].functional.element].rows.push_back(static_cast<Eigen::Index>(i));
  targets_.setZero(static_cast<Eigen::Index>(rows.size()));
  right_side_.setZero(forms_.space.unknowns());
  rows_.resize(0, 0);
  for (size_t e = 0; e < blocks_.size(); ++e) {
    const std::vector<Eigen::Index>& of_element = blocks_[e].rows;
    if (of_element.empty()) continue;
    const auto& unknowns = forms_.space.element_unknowns(e);
    Eigen::MatrixXd& block = blocks_[e].coefficients;
    block.resize(element_coefficients, static_cast<Eigen::Index>(of_element.size()));
    for (size_t j = 0; j < of_element.size(); ++j) {
      const auto i = static_cast<size_t>(of_element[j]);
      const double factor = std::sqrt(rows[i].weight) / rows[i].sigma;
      targets_[static_cast<Eigen::Index>(i)] = factor * rows[i].target;
      block.col(static_cast<Eigen::Index>(j)) = factor * rows[i].functional.coefficients;
    }
    const Eigen::VectorXd pull = block * targets_(of_element);
    for (size_t l = 0; l < element_coefficients; ++l) {
      if (unknowns[l] >= 0) right_side_[unknowns[l]] += pull[static_cast<Eigen::Index>(l)];
    }
    ElementMatrix matrix = ElementMatrix::Zero(element_coefficients, element_coefficients);
    matrix.selfadjointView<Eigen::Lower>().rankUpdate(block);
    forms_.quadratic.add(data_, e, matrix);
  }
}

const Eigen::SparseMatrix<double, Eigen::RowMajor>& SmoothedSystem::weighted_rows() const {
  if (rows_.rows() == targets_.size() && rows_.cols() == forms_.space.unknowns()) return rows_;
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<size_t>(targets_.size()) * element_coefficients);
  for (size_t e = 0; e < blocks_.size(); ++e) {
    const auto& unknowns = forms_.space.element_unknowns(e);
    for (size_t j = 0; j < blocks_[e].rows.size(); ++j) {
      for (size_t l = 0; l < element_coefficients; ++l) {
        if (unknowns[l] < 0) continue;
        entries.emplace_back(
            static_cast<int>(blocks_[e].rows[j]), unknowns[l],
            blocks_[e].coefficients(static_cast<Eigen::Index>(l), static_cast<Eigen::Index>(j)));
      }
    }
  }
  rows_.resize(targets_.size(), forms_.space.unknowns());
  rows_.setFromTriplets(entries.begin(), entries.end());
  return rows_;
}

std::unique_ptr<const CholeskyFactor> SmoothedSystem::factor_of(double lambda, double extent_mm) const {
  QuadraticForms::Values values = data_;
  for (size_t i = 0; i < values.size(); ++i) {
    values[i] +=
        lambda * forms_.sobolev.smoothness[i] + forms_.sobolev.mean_square[i] / (extent_mm * extent_mm);
  }
  std::unique_ptr<const CholeskyFactor> factor = CholeskyFactor::of(forms_.pattern, values);
  // What neither data nor smoothness hold firmly may be lost to rounding: raise the diagonal by as much, then by more.
  for (double relative = 1e-14; !factor && relative < 1e-3; relative *= 100.0) {
    for (size_t i = 0; i < forms_.pattern->unknowns(); ++i)
      values[forms_.pattern->diagonal(i)] *= 1.0 + relative;
    factor = CholeskyFactor::of(forms_.pattern, values);
  }
  return factor;
}

std::unique_ptr<const CholeskyFactor> SmoothedSystem::factor_at(double lambda) const {
  return factor_of(lambda, extent_of_motion_mm_);
}

void SmoothedSystem::factorise(double lambda) {
  lambda_ = lambda;
  factor_ = factor_at(lambda);
}

void SmoothedSystem::factorise_without_smoothness(double amplitude_mm) {
  lambda_ = 0.0;
  factor_ = factor_of(0.0, amplitude_mm);
}

Eigen::VectorXd SmoothedSystem::solution() const { return solve(right_side_); }

Eigen::MatrixXd SmoothedSystem::solve(const Eigen::MatrixXd& right_sides) const {
  if (factor_) return factor_->solve(right_sides);
  return Eigen::MatrixXd::Constant(right_sides.rows(), right_sides.cols(),
                                   std::numeric_limits<double>::quiet_NaN());
}

std::vector<double> SmoothedSystem::variances(std::span<const Functional> functionals) const {
  std::vector<double> result;
  result.reserve(functionals.size());
  for (size_t first = 0; first < functionals.size(); first += solved_at_once) {
    const size_t count = std::min(solved_at_once, functionals.size() - first);
    Eigen::MatrixXd columns =
        Eigen::MatrixXd::Zero(forms_.space.unknowns(), static_cast<Eigen::Index>(count));
    for (size_t j = 0; j < count; ++j)
      forms_.space.add_to(columns.col(static_cast<Eigen::Index>(j)), functionals[first + j]);
    const Eigen::MatrixXd solved = solve(columns);
    for (Eigen::Index j = 0; j < static_cast<Eigen::Index>(count); ++j)
      result.push_back(columns.col(j).dot(solved.col(j)));
  }
  return result;
}

}  // namespace diastole
