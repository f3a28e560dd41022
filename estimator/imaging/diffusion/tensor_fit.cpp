#include "estimator/imaging/diffusion/tensor_fit.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/parallel/parallel_for.hpp"
#include "protocol/signal/median.hpp"

namespace diastole::imaging {
namespace {

constexpr double b_unit = 1e-3;  // D is in 1e-3 mm²/s

/// The median of a chi-square variable (Wilson and Hilferty 1931).
double chi_square_median(int freedom) {
  const double k = freedom;
  return k * std::pow(1 - 2 / (9 * k), 3);
}

std::vector<VoxelTensor> fit_slice(const DiffusionSeries& series, size_t slice) {
  std::vector<size_t> there;
  std::vector<Image> images;
  for (size_t v = 0; v < series.volumes.size(); ++v) {
    if (!series.volumes[v].images[slice]) continue;
    there.push_back(v);
    images.push_back(positive_signals(*series.volumes[v].images[slice]));
  }
  const TensorSolver solver(tensor_design(series, there));
  const SlicePlane& plane = series.slices[slice];
  std::vector<VoxelTensor> voxels;
  Eigen::VectorXd signals(static_cast<Eigen::Index>(there.size()));
  for (int row = 0; row < plane.rows; ++row) {
    for (int column = 0; column < plane.columns; ++column) {
      for (size_t i = 0; i < there.size(); ++i)
        signals[static_cast<Eigen::Index>(i)] = static_cast<double>(images[i](row, column));
      const TensorSolution fit = solver.solve(signals);
      VoxelTensor voxel;
      voxel.slice = static_cast<int>(slice);
      voxel.row = row;
      voxel.column = column;
      voxel.place_mm = plane.at({column * plane.column_spacing_mm, row * plane.row_spacing_mm});
      voxel.tensor = fit.unknowns.head<6>();
      voxel.covariance = fit.covariance.topLeftCorner<6, 6>();
      voxel.s0 = std::exp(fit.unknowns[6]);
      voxel.chi_square = (fit.predicted.array() * fit.residual.array()).square().sum();
      voxel.freedom = static_cast<int>(there.size()) - tensor_unknowns;
      voxels.push_back(voxel);
    }
  }
  return voxels;
}

/// Noise of the images: the median of the residuals' variance over voxels that are brighter than `least_snr` sigmas of it, for magnitudes of
/// air vary less. Found in a few rounds, from the brighter half of all voxels.
double noise_of(const std::vector<VoxelTensor>& voxels, double least_snr) {
  if (voxels.empty()) return 0;
  std::vector<double> brightness;
  for (const VoxelTensor& voxel : voxels)
    brightness.push_back(voxel.s0);
  double least_s0 = signal::median(std::move(brightness)), sigma = 0;
  constexpr int rounds = 5;
  for (int i = 0; i < rounds; ++i) {
    std::vector<double> variances;
    for (const VoxelTensor& voxel : voxels)
      if (voxel.s0 >= least_s0 && voxel.freedom > 0)
        variances.push_back(voxel.chi_square / chi_square_median(voxel.freedom));
    if (variances.empty()) break;
    sigma = std::sqrt(signal::median(std::move(variances)));
    least_s0 = least_snr * sigma;
  }
  return sigma;
}

/// Of a fit without residuals: errors in proportion to each other, as of an SNR of 20.
double nominal_sigma(const std::vector<VoxelTensor>& voxels) {
  std::vector<double> brightness;
  for (const VoxelTensor& voxel : voxels)
    brightness.push_back(voxel.s0);
  return brightness.empty() ? 0 : signal::median(std::move(brightness)) / 20;
}

}  // namespace

Image positive_signals(const Image& image) {
  float least = 0;
  for (Eigen::Index i = 0; i < image.size(); ++i) {
    const float value = image.data()[i];
    if (value > 0 && (least == 0 || value < least)) least = value;
  }
  return image.max(least > 0 ? least : 1.0F);
}

Eigen::Matrix3d matrix_of(const TensorNumbers& d) {
  Eigen::Matrix3d matrix;
  matrix << d[0], d[1], d[2], d[1], d[3], d[4], d[2], d[4], d[5];
  return matrix;
}

TensorNumbers numbers_of(const Eigen::Matrix3d& m) {
  TensorNumbers numbers;
  numbers << m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2);
  return numbers;
}

double deviator_noise(const TensorCovariance& covariance) {
  TensorNumbers weight;
  weight << 1, 2, 2, 1, 2, 1;  // off-diagonal numbers stand twice in the norm
  const TensorNumbers trace = numbers_of(Eigen::Matrix3d::Identity());
  return std::max(0.0, covariance.diagonal().dot(weight) - trace.dot(covariance * trace) / 3);
}

TensorShape shape_of(const TensorNumbers& tensor) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(matrix_of(tensor));
  TensorShape shape;
  shape.values = eigen.eigenvalues().reverse();
  shape.vectors = eigen.eigenvectors().rowwise().reverse();
  shape.md = shape.values.mean();
  const double spread = (shape.values.array() - shape.md).matrix().squaredNorm();
  const double size = shape.values.squaredNorm();
  shape.fa = size > 0 ? std::sqrt(1.5 * spread / size) : 0;
  return shape;
}

TensorDesign tensor_design(const DiffusionSeries& series, const std::vector<size_t>& volumes) {
  TensorDesign design(static_cast<Eigen::Index>(volumes.size()), tensor_unknowns);
  for (size_t i = 0; i < volumes.size(); ++i) {
    const Eigen::Matrix3d b = b_unit * series.volumes[volumes[i]].b_matrix;
    design.row(static_cast<Eigen::Index>(i)) << -b(0, 0), -2 * b(0, 1), -2 * b(0, 2), -b(1, 1), -2 * b(1, 2),
        -b(2, 2), 1.0;
  }
  return design;
}

int design_rank(const TensorDesign& design) {
  // Schemes in use have a condition number below 20; a missing direction leaves what rounding of headers gives.
  constexpr double least_share = 1e-3;
  if (design.rows() == 0) return 0;
  TensorDesign scaled = design;
  for (int j = 0; j < tensor_unknowns; ++j)
    if (const double length = scaled.col(j).norm(); length > 0) scaled.col(j) /= length;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled);
  const Eigen::VectorXd singular = svd.singularValues();
  return static_cast<int>((singular.array() > least_share * singular[0]).count());
}

TensorSolver::TensorSolver(TensorDesign design) : design_(std::move(design)) {
  unweighted_ =
      design_.colPivHouseholderQr().solve(Eigen::MatrixXd::Identity(design_.rows(), design_.rows()));
}

TensorSolution TensorSolver::solve(const Eigen::VectorXd& signals) const {
  const Eigen::VectorXd logs = signals.array().log();
  const Eigen::VectorXd first = (design_ * (unweighted_ * logs)).array().exp();
  const TensorDesign weighted = first.asDiagonal() * design_;
  const Eigen::VectorXd target = first.cwiseProduct(logs);
  const Eigen::HouseholderQR<TensorDesign> qr(weighted);
  TensorSolution solution;
  solution.unknowns = Eigen::VectorXd(qr.solve(target));
  const Eigen::Matrix<double, tensor_unknowns, tensor_unknowns> r =
      qr.matrixQR().topRows(tensor_unknowns).triangularView<Eigen::Upper>();
  const Eigen::Matrix<double, tensor_unknowns, tensor_unknowns> inverse =
      r.triangularView<Eigen::Upper>().solve(
          Eigen::Matrix<double, tensor_unknowns, tensor_unknowns>::Identity());
  solution.covariance = inverse * inverse.transpose();
  solution.residual = logs - design_ * solution.unknowns;
  solution.predicted = first;
  solution.leverage = (weighted * inverse).rowwise().squaredNorm();
  return solution;
}

TensorImage fit_tensors(const DiffusionSeries& series, double least_snr) {
  std::vector<std::vector<VoxelTensor>> slices(series.slices.size());
  parallel_for(slices.size(), machine_threads(), [&](size_t s) { slices[s] = fit_slice(series, s); });
  std::vector<VoxelTensor> all;
  for (std::vector<VoxelTensor>& slice : slices)
    all.insert(all.end(), slice.begin(), slice.end());
  TensorImage image;
  image.sigma = noise_of(all, least_snr);
  const double sigma = image.sigma > 0 ? image.sigma : nominal_sigma(all);
  const double variance = sigma * sigma;
  for (VoxelTensor& voxel : all) {
    if (!(voxel.s0 > least_snr * image.sigma)) continue;
    voxel.covariance *= variance;
    voxel.chi_square = variance > 0 ? voxel.chi_square / variance : 0;
    if (shape_of(voxel.tensor).values[2] <= 0) ++image.not_positive;
    image.voxels.push_back(voxel);
  }
  return image;
}

}  // namespace diastole::imaging
