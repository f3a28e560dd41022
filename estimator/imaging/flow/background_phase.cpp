#include "estimator/imaging/flow/background_phase.hpp"

#include <cmath>
#include <complex>
#include <map>
#include <vector>

namespace diastole::imaging {
namespace {

constexpr int highest_order = 4;
/// Of still material; fewer do not surround a lumen.
constexpr size_t least_pixels = 50;

Eigen::VectorXd monomials(double x, double y, int order) {
  Eigen::VectorXd values((order + 1) * (order + 2) / 2);
  Eigen::Index at = 0;
  for (int degree = 0; degree <= order; ++degree)
    for (int power = 0; power <= degree; ++power)
      values[at++] = std::pow(x, degree - power) * std::pow(y, power);
  return values;
}

struct StillPixel {
  double x, y;           // from the lumen, over the scale
  double phase, weight;  // the weight is one over the variance of the mean over the cycle
};

struct Polynomial {
  Eigen::VectorXd coefficients;
  Eigen::MatrixXd covariance;
  double chi_square = 0;
};

Polynomial fitted(const std::vector<StillPixel>& pixels, int order) {
  const Eigen::Index count = (order + 1) * (order + 2) / 2;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
  double squares = 0;
  for (const StillPixel& pixel : pixels) {
    const Eigen::VectorXd row = monomials(pixel.x, pixel.y, order);
    normal.noalias() += pixel.weight * row * row.transpose();
    right += pixel.weight * pixel.phase * row;
    squares += pixel.weight * pixel.phase * pixel.phase;
  }
  Polynomial result;
  const Eigen::LDLT<Eigen::MatrixXd> factor(normal);
  result.coefficients = factor.solve(right);
  result.covariance = factor.solve(Eigen::MatrixXd::Identity(count, count));
  result.chi_square = squares - result.coefficients.dot(right);
  return result;
}

/// Variance of the residuals' means over squares as large as the lumen, beyond their noise.
double structure_left(const std::vector<StillPixel>& pixels, const Polynomial& polynomial, int order,
                      double side) {
  struct Square {
    double sum = 0, weight = 0;
    size_t count = 0;
  };
  std::map<std::pair<long, long>, Square> squares;
  size_t most = 0;
  for (const StillPixel& pixel : pixels) {
    Square& square = squares[{std::lround(pixel.x / side), std::lround(pixel.y / side)}];
    const double left = pixel.phase - monomials(pixel.x, pixel.y, order).dot(polynomial.coefficients);
    square.sum += pixel.weight * left;
    square.weight += pixel.weight;
    most = std::max(most, ++square.count);
  }
  double excess = 0, count = 0;
  for (const auto& [place, square] : squares) {
    if (2 * square.count < most) continue;
    const double mean = square.sum / square.weight;
    excess += mean * mean - 1 / square.weight;
    count += 1;
  }
  return count < 4 ? 0 : std::max(0.0, excess / count);
}

}  // namespace

double BackgroundPhase::at(double column, double row) const {
  if (order < 0) return 0;
  return monomials((column - origin.x()) / scale_px, (row - origin.y()) / scale_px, order).dot(coefficients);
}

BackgroundPhase background_phase(const MotionMap& map,
                                 const Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>& still,
                                 const Eigen::Vector2d& lumen, double lumen_radius_px) {
  BackgroundPhase best;
  best.order = -1;
  best.origin = lumen;
  best.scale_px = 0.5 * static_cast<double>(std::max(still.rows(), still.cols()));
  std::complex<double> sum = 0;
  for (Eigen::Index i = 0; i < still.size(); ++i)
    if (still.data()[i])
      sum += std::polar(static_cast<double>(map.mean_magnitude.data()[i]),
                        static_cast<double>(map.mean_phase.data()[i]));
  const double middle = std::arg(sum);
  std::vector<StillPixel> pixels;
  for (Eigen::Index column = 0; column < still.cols(); ++column) {
    for (Eigen::Index row = 0; row < still.rows(); ++row) {
      if (!still(row, column)) continue;
      const double signal =
          static_cast<double>(map.mean_magnitude(row, column)) / map.noise.magnitude_times_phase;
      pixels.push_back({(static_cast<double>(column) - lumen.x()) / best.scale_px,
                        (static_cast<double>(row) - lumen.y()) / best.scale_px,
                        middle + within_half_turn(static_cast<double>(map.mean_phase(row, column)) - middle),
                        signal * signal * static_cast<double>(map.phases)});
    }
  }
  best.pixels = pixels.size();
  if (pixels.size() < least_pixels) return best;
  double least = 0;
  for (int order = 0; order <= highest_order; ++order) {
    const Polynomial polynomial = fitted(pixels, order);
    const auto count = static_cast<double>(polynomial.coefficients.size());
    const auto all = static_cast<double>(pixels.size());
    const double criterion = polynomial.chi_square + count * std::log(all);
    if (best.order >= 0 && criterion >= least) continue;
    least = criterion;
    best.order = order;
    best.coefficients = polynomial.coefficients;
    best.reduced_chi_square = polynomial.chi_square / (all - count);
    best.at_lumen_rad = polynomial.coefficients[0];
    best.sigma_rad = std::sqrt(
        polynomial.covariance(0, 0) * std::max(1.0, best.reduced_chi_square) +
        structure_left(pixels, polynomial, order, 2 * std::max(3.0, lumen_radius_px) / best.scale_px));
  }
  return best;
}

}  // namespace diastole::imaging
