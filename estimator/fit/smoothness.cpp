#include "estimator/fit/smoothness.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "estimator/mesh/face_map.hpp"

namespace diastole {
namespace {

constexpr int grid_points = 57;
constexpr double least_step = 0.002, greatest_step = 2.0;

/// Whether the face's corners lie on a line.
bool is_collapsed(const HermiteMesh& mesh, const ElementFace& face) {
  std::set<size_t> places;
  for (const size_t corner : face_corners(face))
    places.insert(mesh.place_of(mesh.element(face.element)[corner]));
  return places.size() < 3;
}

double area_mm2(const HermiteMesh& mesh, const ElementFace& face) {
  const auto corner_mm = [&](size_t corner) -> Eigen::Vector3d {
    const size_t node = mesh.element(face.element)[corner];
    const auto at = [&](size_t component) { return mesh.reference()[dof_of(node, 0, component)]; };
    return {at(0), at(1), at(2)};
  };
  const std::array<size_t, 4> corners = face_corners(face);
  const Eigen::Vector3d one = corner_mm(corners[3]) - corner_mm(corners[0]);
  const Eigen::Vector3d other = corner_mm(corners[2]) - corner_mm(corners[1]);
  return one.cross(other).norm() / 2;
}

Eigen::Vector3d centre_mm(const HermiteMesh& mesh, size_t element) {
  return mesh.value(mesh.reference(), {element, {0.5, 0.5, 0.5}});
}

double log_determinant(const Eigen::LDLT<Eigen::MatrixXd>& factor) {
  return factor.vectorD().array().abs().max(1e-300).log().sum();
}

Eigen::Index rank_of(const Eigen::MatrixXd& differences) {
  return Eigen::FullPivLU<Eigen::MatrixXd>(differences.transpose() * differences).rank();
}

/// Rows and columns of the free unknowns; the others get the unit matrix.
void drop_held(Eigen::MatrixXd& matrix, const std::vector<bool>& is_free) {
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    if (is_free[static_cast<size_t>(i)]) continue;
    matrix.row(i).setZero();
    matrix.col(i).setZero();
    matrix(i, i) = 1;
  }
}

void drop_held(Eigen::VectorXd& vector, const std::vector<bool>& is_free) {
  for (Eigen::Index i = 0; i < vector.size(); ++i) {
    if (!is_free[static_cast<size_t>(i)]) vector[i] = 0;
  }
}

/// Precision that the blocks' priors add to the unknowns.
Eigen::MatrixXd prior_precision(const std::vector<SmoothBlock>& blocks, Eigen::Index unknowns) {
  Eigen::MatrixXd precision = Eigen::MatrixXd::Zero(unknowns, unknowns);
  for (const SmoothBlock& block : blocks) {
    const Eigen::Index count = block.differences.cols();
    precision.block(block.first, block.first, count, count) +=
        block.differences.transpose() * block.differences / (block.step * block.step);
  }
  return precision;
}

}  // namespace

Eigen::MatrixXd neighbour_differences(const HermiteMesh& mesh) {
  const FaceMap faces(mesh);
  struct Pair {
    size_t one, other;
    double weight;
  };
  std::vector<Pair> pairs;
  for (size_t element = 0; element < mesh.element_count(); ++element) {
    for (size_t number = 0; number < 6; ++number) {
      const ElementFace face{element, number / 2, number % 2};
      const ElementFace& first = faces.meeting(face).front();
      if (first.element == element || is_collapsed(mesh, face)) continue;
      const double apart_mm = (centre_mm(mesh, element) - centre_mm(mesh, first.element)).norm();
      pairs.push_back({first.element, element, area_mm2(mesh, first) / apart_mm});
    }
  }
  double sum = 0;
  for (const Pair& pair : pairs)
    sum += pair.weight;
  Eigen::MatrixXd differences = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(pairs.size()),
                                                      static_cast<Eigen::Index>(mesh.element_count()));
  for (size_t i = 0; i < pairs.size(); ++i) {
    const double root = std::sqrt(pairs[i].weight * static_cast<double>(pairs.size()) / sum);
    differences(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(pairs[i].one)) = root;
    differences(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(pairs[i].other)) = -root;
  }
  return differences;
}

EvidenceOfStep evidence_of_step(const QuadraticModel& model, const std::vector<SmoothBlock>& blocks,
                                size_t which, const std::vector<bool>& is_free) {
  std::vector<SmoothBlock> trial = blocks;
  const auto rank = static_cast<double>(rank_of(blocks[which].differences));
  EvidenceOfStep result{};
  std::vector<double> log_evidence;
  for (int i = 0; i < grid_points; ++i) {
    const double step = least_step * std::pow(greatest_step / least_step, i / (grid_points - 1.0));
    trial[which].step = step;
    const Eigen::MatrixXd precision = prior_precision(trial, model.q.size());
    Eigen::MatrixXd hessian = model.hessian + precision;
    Eigen::VectorXd gradient = model.gradient + precision * model.q;
    drop_held(hessian, is_free);
    drop_held(gradient, is_free);
    const Eigen::LDLT<Eigen::MatrixXd> factor(hessian);
    const Eigen::VectorXd change = -factor.solve(gradient);
    const double cost = 0.5 * gradient.dot(change) + 0.5 * model.q.dot(precision * model.q);
    log_evidence.push_back(-cost - rank * std::log(step) - 0.5 * log_determinant(factor));
    result.steps.push_back(step);
    result.q.push_back(model.q + change);
    Eigen::MatrixXd covariance = factor.solve(Eigen::MatrixXd::Identity(hessian.rows(), hessian.cols()));
    for (Eigen::Index k = 0; k < covariance.rows(); ++k) {
      if (!is_free[static_cast<size_t>(k)]) covariance(k, k) = 0;
    }
    result.covariance.push_back(std::move(covariance));
  }
  const auto best = std::max_element(log_evidence.begin(), log_evidence.end());
  result.step = result.steps[static_cast<size_t>(best - log_evidence.begin())];
  result.none_seen = best == log_evidence.begin();
  double sum = 0;
  for (size_t i = 0; i < log_evidence.size(); ++i) {
    // On a logarithmic grid a flat prior on the step is a weight proportional to it.
    result.weights.push_back(std::exp(log_evidence[i] - *best) * result.steps[i]);
    sum += result.weights.back();
  }
  for (double& weight : result.weights)
    weight /= sum;
  return result;
}

}  // namespace diastole
