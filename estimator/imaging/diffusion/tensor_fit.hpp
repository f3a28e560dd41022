#pragma once
// Diffusion tensors by weighted least squares of log signals (Basser, Mattiello, LeBihan 1994; weights as Salvador et al. 2005):
//
//   ln S_i = ln S0 - B_i : D + noise/S_i        w_i = S_i(first fit)²        D in 1e-3 mm²/s, B in s/mm²
//
// The same estimator as DIPY's WLS: the weights are those of the unweighted fit. Order of a tensor's six numbers: xx, xy, xz, yy, yz, zz.

#include <Eigen/Dense>
#include <array>
#include <vector>

#include "estimator/imaging/diffusion/diffusion_series.hpp"

namespace diastole::imaging {

inline constexpr int tensor_unknowns = 7;  ///< D and ln S0
using TensorNumbers = Eigen::Matrix<double, 6, 1>;
using TensorCovariance = Eigen::Matrix<double, 6, 6>;

Eigen::Matrix3d matrix_of(const TensorNumbers& numbers);
TensorNumbers numbers_of(const Eigen::Matrix3d& matrix);

struct TensorShape {
  Eigen::Vector3d values;   ///< descending, 1e-3 mm²/s
  Eigen::Matrix3d vectors;  ///< columns, in their order
  double fa, md;
};
TensorShape shape_of(const TensorNumbers& tensor);

/// The mean square of the deviator (as a matrix) of tensors that are nothing but noise of this covariance.
double deviator_noise(const TensorCovariance& covariance);

struct VoxelTensor {
  int slice = 0, row = 0, column = 0;
  Eigen::Vector3d place_mm;     ///< patient
  TensorNumbers tensor;         ///< 1e-3 mm²/s, patient axes
  TensorCovariance covariance;  ///< for noise of the image's sigma, of s0/20 where that is unknown
  double s0 = 0;
  double chi_square = 0;  ///< of the log signals' weighted residuals, for noise of the image's sigma
  int freedom = 0;        ///< measurements - unknowns
};

/// Rows -B (1e-3 mm²/s units), 1 for each of these volumes: seven columns.
using TensorDesign = Eigen::MatrixXd;
TensorDesign tensor_design(const DiffusionSeries& series, const std::vector<size_t>& volumes);
/// Of the columns scaled to one length: singular values above 1e-3 of the largest.
int design_rank(const TensorDesign& design);

struct TensorSolution {
  Eigen::Matrix<double, tensor_unknowns, 1> unknowns;
  Eigen::Matrix<double, tensor_unknowns, tensor_unknowns> covariance;  ///< for sigma = 1
  Eigen::VectorXd residual;                                            ///< ln S - fit
  Eigen::VectorXd predicted;                                           ///< signal
  Eigen::VectorXd leverage;  ///< of the weighted fit: of a measurement on its own prediction
};

/// One voxel's fit. Precondition: signals positive, the design of full rank.
class TensorSolver {
 public:
  explicit TensorSolver(TensorDesign design);
  [[nodiscard]] TensorSolution solve(const Eigen::VectorXd& signals) const;

 private:
  TensorDesign design_;
  Eigen::MatrixXd unweighted_;  ///< pseudo-inverse
};

/// For logarithms: what is not positive becomes the image's least positive signal, or 1 if it has none.
Image positive_signals(const Image& image);

struct TensorImage {
  double sigma =
      0;  ///< noise of the images, from the residuals of voxels brighter than noise; 0: unknown, for want of residuals
  std::vector<VoxelTensor> voxels;
  size_t not_positive = 0;  ///< voxels with an eigenvalue that is not positive
};

/// All voxels whose signal without weighting is above `least_snr` noise sigmas; magnitudes below are noise. Signals are made positive
/// (positive_signals).
TensorImage fit_tensors(const DiffusionSeries& series, double least_snr = 5.0);

}  // namespace diastole::imaging
