#include "estimator/imaging/diffusion/fibre_estimate.hpp"

#include <fmt/format.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <random>
#include <stdexcept>
#include <utility>

#include "estimator/mesh/fibre_field.hpp"
#include "estimator/mesh/helix_course.hpp"
#include "estimator/mesh/nodal_lines.hpp"
#include "estimator/parallel/parallel_for.hpp"
#include "estimator/sparse/sparse_cholesky.hpp"
#include "protocol/contract/angle.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::imaging {
namespace {

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;
using Sparse = Eigen::SparseMatrix<double>;

constexpr size_t fields = 5;  // alpha, gamma, A, B1, B2
enum Field : size_t { helix, transverse, anisotropy, sheet_even, sheet_odd };

constexpr size_t least_voxels = 50;
constexpr double student_freedom = 5;
/// A bend between neighbours, before the data say how much: radians, 1e-3 mm²/s. Only the first iteration depends on it.
constexpr std::array<double, fields> first_bend{5 * rad_per_deg, 3 * rad_per_deg, 0.03, 0.03, 0.03};
/// In a heart no fibre leaves the wall by more than this, and no tensor is this anisotropic: what holds nodes that no voxel knows.
constexpr std::array<double, fields> widest{180 * rad_per_deg, 30 * rad_per_deg, 1.0, 1.0, 1.0};
/// Anisotropy known no better than this share even where a voxel is all wall: tensors of mixed depths are no mean of tensors.
constexpr double size_slack = 0.05;
constexpr int most_iterations = 40;
constexpr double settled_rad = 0.1 * rad_per_deg;  // root mean square
constexpr double longest_step_rad = 20 * rad_per_deg;
constexpr std::array<double, 3> bend_weights{1, -2, 1};
constexpr int probes = 16;
constexpr int draw_count = 128;  // standard deviations to 6 %

/// Orthonormal coordinates of a deviator.
Vector5 coordinates(const Eigen::Matrix3d& m) {
  const double s2 = std::numbers::sqrt2;
  Vector5 v;
  v << (m(0, 0) - m(1, 1)) / s2, (2 * m(2, 2) - m(0, 0) - m(1, 1)) / std::sqrt(6.0), s2 * m(0, 1),
      s2 * m(0, 2), s2 * m(1, 2);
  return v;
}

Eigen::Matrix3d deviator_of(const Vector5& v) {
  const double a = v[0] / std::numbers::sqrt2, z = v[1] / std::sqrt(6.0);
  Eigen::Matrix3d m;
  m << a - z, v[2] / std::numbers::sqrt2, v[3] / std::numbers::sqrt2, 0, -a - z, v[4] / std::numbers::sqrt2,
      0, 0, 2 * z;
  return m.selfadjointView<Eigen::Upper>();
}

Eigen::Matrix3d skew(const Eigen::Vector3d& w) {
  Eigen::Matrix3d m;
  m << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return m;
}

/// f, c, n in wall axes.
Eigen::Matrix3d triad(double alpha, double gamma) {
  Eigen::Matrix3d axes;
  axes.col(0) << std::cos(gamma) * std::cos(alpha), std::cos(gamma) * std::sin(alpha), std::sin(gamma);
  axes.col(1) << -std::sin(alpha), std::cos(alpha), 0;
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

/// The deviator at a place and its derivatives by the five fields.
struct LocalModel {
  Vector5 value;
  Matrix5 slope;
};

LocalModel local_model(const Eigen::Matrix3d& wall, const std::array<double, fields>& u) {
  const Eigen::Matrix3d axes = wall * triad(u[helix], u[transverse]);
  const Eigen::Vector3d f = axes.col(0), c = axes.col(1), n = axes.col(2);
  const Eigen::Matrix3d of_a = f * f.transpose() - Eigen::Matrix3d::Identity() / 3;
  const Eigen::Matrix3d of_b1 = c * c.transpose() - n * n.transpose();
  const Eigen::Matrix3d of_b2 = c * n.transpose() + n * c.transpose();
  const Eigen::Matrix3d m = u[anisotropy] * of_a + u[sheet_even] * of_b1 + u[sheet_odd] * of_b2;
  const Eigen::Matrix3d by_alpha = skew(wall.col(2)), by_gamma = skew(-c);  // rotations
  LocalModel local;
  local.value = coordinates(m);
  local.slope.col(helix) = coordinates(by_alpha * m - m * by_alpha);
  local.slope.col(transverse) = coordinates(by_gamma * m - m * by_gamma);
  local.slope.col(anisotropy) = coordinates(of_a);
  local.slope.col(sheet_even) = coordinates(of_b1);
  local.slope.col(sheet_odd) = coordinates(of_b2);
  return local;
}

/// One voxel's part in the normal equations: what it knows, and of which nodes.
struct Datum {
  Vector5 seen;
  Matrix5 covariance;
  double fraction;
  std::vector<size_t> nodes;                        ///< different ones
  std::vector<std::array<uint8_t, corners>> place;  ///< of each sample's corners among them
  const WallVoxel* voxel;

  // Of the present fields:
  Vector5 model;
  std::vector<Matrix5> slope;  ///< by each of `nodes`
  Matrix5 information;         ///< inverse covariance, without the noise scale
  double weight = 1;           ///< Student's
};

Datum datum_of(const WallVoxel& voxel, const HermiteMesh& mesh) {
  Datum datum;
  Eigen::Matrix<double, 5, 6> map;
  for (int k = 0; k < 6; ++k)
    map.col(k) = coordinates(matrix_of(TensorNumbers::Unit(k)));
  datum.seen = map * voxel.voxel->tensor;
  // What rounding of stored signals leaves of noise at least.
  constexpr double least_variance = 1e-8;
  datum.covariance = map * voxel.voxel->covariance * map.transpose() + least_variance * Matrix5::Identity();
  datum.fraction = voxel.fraction;
  datum.voxel = &voxel;
  for (const WallSample& sample : voxel.samples) {
    auto& place = datum.place.emplace_back();
    for (size_t c = 0; c < corners; ++c) {
      const size_t node = mesh.element(sample.element)[c];
      auto found = std::find(datum.nodes.begin(), datum.nodes.end(), node);
      if (found == datum.nodes.end()) found = datum.nodes.insert(found, node);
      place[c] = static_cast<uint8_t>(found - datum.nodes.begin());
    }
  }
  return datum;
}

/// Fields that share their smoothness: strengths of second differences in the wall and through it.
struct Smoothness {
  std::vector<size_t> fields;
  std::array<double, 2> strength;
};

class Estimation {
 public:
  Estimation(const FibreLattice& lattice, const std::vector<WallVoxel>& voxels)
      : lattice_(lattice), unknowns_(fields * lattice.mesh.node_count()) {
    for (const WallVoxel& voxel : voxels)
      data_.push_back(datum_of(voxel, lattice.mesh));
    add_penalties();
    find_pattern();
    start(voxels);
    std::mt19937_64 random(1);
    std::bernoulli_distribution coin;
    signs_.resize(static_cast<Eigen::Index>(unknowns_), probes);
    for (Eigen::Index i = 0; i < signs_.size(); ++i)
      signs_.data()[i] = coin(random) ? 1 : -1;
  }

  void run() {
    int quiet = 0;
    for (iterations_ = 1; iterations_ <= most_iterations && quiet < 2; ++iterations_) {
      evaluate();
      const double changed = step();
      update_strengths();
      quiet = changed < settled_rad ? quiet + 1 : 0;
    }
    converged_ = quiet >= 2;
    evaluate();
    factorise();
  }

  FibreEstimate result(FibreLattice lattice) const {
    FibreEstimate estimate{.lattice = std::move(lattice), .nodes = angles(u_)};
    for (size_t n = 0; n < estimate.nodes.size(); ++n)
      estimate.anisotropy.push_back(at(u_, n, anisotropy));
    const Eigen::MatrixXd deviations = factor_->solve(forces_of_draws());
    for (int d = 0; d < draw_count; ++d)
      estimate.draws.push_back(angles(u_ + deviations.col(d)));
    estimate.voxels = data_.size();
    estimate.noise_scale = std::sqrt(noise_);
    estimate.freedom = freedom_;
    estimate.iterations = iterations_;
    estimate.converged = converged_;
    double squares = 0;
    for (const Datum& datum : data_) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> model(deviator_of(datum.model));
      const double cosine =
          std::abs(model.eigenvectors().col(2).dot(shape_of(datum.voxel->voxel->tensor).vectors.col(0)));
      squares += std::pow(std::acos(std::min(1.0, cosine)) / rad_per_deg, 2);
    }
    estimate.rms_deg = std::sqrt(squares / static_cast<double>(data_.size()));
    return estimate;
  }

 private:
  /// Columns of covariance H, the system's matrix: what noise of the data and of the priors adds to the normal equations. H⁻¹ of them are
  /// draws from the posterior.
  [[nodiscard]] Eigen::MatrixXd forces_of_draws() const {
    std::mt19937_64 random(2);
    std::normal_distribution<double> normal;
    const auto whites = [&](Eigen::Index rows) {
      return Eigen::MatrixXd(Eigen::MatrixXd::NullaryExpr(rows, draw_count, [&] { return normal(random); }));
    };
    Eigen::MatrixXd forces = holding_.cwiseSqrt().asDiagonal() * whites(u_.size());
    for (const Datum& datum : data_) {
      const Eigen::MatrixXd root = Eigen::LLT<Eigen::MatrixXd>(datum.weight * datum.information).matrixL();
      const Eigen::MatrixXd white = datum.fraction * (root * whites(5));
      for (size_t i = 0; i < datum.nodes.size(); ++i)
        forces.middleRows<5>(static_cast<Eigen::Index>(fields * datum.nodes[i])) +=
            datum.slope[i].transpose() * white;
    }
    for (const Smoothness& smoothness : smoothness_) {
      for (const size_t field : smoothness.fields) {
        for (const auto& difference : differences_) {
          const double root = std::sqrt(smoothness.strength[difference.direction == 2 ? 1 : 0]);
          const Eigen::MatrixXd white = root * whites(1);
          for (size_t i = 0; i < 3; ++i)
            forces.row(static_cast<Eigen::Index>(fields * difference.nodes[i] + field)) +=
                bend_weights[i] * white;
        }
      }
    }
    return forces;
  }

  static double at(const Eigen::VectorXd& u, size_t node, size_t field) {
    return u[static_cast<Eigen::Index>(fields * node + field)];
  }

  static std::vector<FibreAngles> angles(const Eigen::VectorXd& u) {
    std::vector<FibreAngles> all;
    for (size_t n = 0; n < static_cast<size_t>(u.size()) / fields; ++n)
      all.push_back({at(u, n, helix) / rad_per_deg, at(u, n, transverse) / rad_per_deg});
    return all;
  }

  void add_penalties() {
    const auto nodes = static_cast<Eigen::Index>(lattice_.mesh.node_count());
    std::array<std::vector<Eigen::Triplet<double>>, 2> entries;
    differences_ = NodalLines(lattice_.mesh).second_differences();
    for (const auto& difference : differences_)
      for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j)
          entries[difference.direction == 2 ? 1 : 0].emplace_back(static_cast<int>(difference.nodes[i]),
                                                                  static_cast<int>(difference.nodes[j]),
                                                                  bend_weights[i] * bend_weights[j]);
    for (size_t k = 0; k < 2; ++k) {
      bends_[k].resize(nodes, nodes);
      bends_[k].setFromTriplets(entries[k].begin(), entries[k].end());
    }
    for (const std::vector<size_t>& alike : {std::vector{size_t{helix}},
                                             {size_t{transverse}},
                                             {size_t{anisotropy}},
                                             {size_t{sheet_even}, size_t{sheet_odd}}}) {
      const double strength = std::pow(first_bend[alike[0]], -2);
      smoothness_.push_back({alike, {strength, strength}});
    }
    holding_.resize(static_cast<Eigen::Index>(unknowns_));
    for (size_t i = 0; i < unknowns_; ++i)
      holding_[static_cast<Eigen::Index>(i)] = std::pow(widest[i % fields], -2);
  }

  /// One field's nodal values of each column.
  static Eigen::MatrixXd field_of(const Eigen::MatrixXd& all, size_t field) {
    return all(Eigen::seqN(static_cast<Eigen::Index>(field), all.rows() / static_cast<Eigen::Index>(fields),
                           static_cast<Eigen::Index>(fields)),
               Eigen::all);
  }

  static uint64_t key(size_t row, size_t column) { return uint64_t{row} << 32U | column; }

  /// Pairs of nodes that share a voxel, row >= column.
  void find_pattern() {
    for (const Datum& datum : data_) {
      for (const size_t row : datum.nodes)
        for (const size_t column : datum.nodes)
          if (row >= column) pattern_.push_back(key(row, column));
      if (pattern_.size() > 4'000'000) compact();
    }
    compact();
    blocks_.resize(pattern_.size());
  }

  void compact() {
    std::sort(pattern_.begin(), pattern_.end());
    pattern_.erase(std::unique(pattern_.begin(), pattern_.end()), pattern_.end());
  }

  /// Mean tensors by depth give the helix's course; it is the same everywhere at first.
  void start(const std::vector<WallVoxel>& voxels) {
    HelixCourse course;
    for (const WallVoxel& voxel : voxels) {
      const Eigen::Matrix3d& wall = voxel.middle_axes();
      course.add(voxel.depth, wall.transpose() * matrix_of(voxel.voxel->tensor) * wall);
    }
    const auto helices = course.angles_rad();
    Eigen::Vector3d size = Eigen::Vector3d::Zero();  // A, B1, B2
    for (size_t d = 0; d < HelixCourse::depths; ++d) {
      if (course.count_at(d) == 0) continue;
      const Eigen::Matrix3d axes = triad(helices[d], 0);
      const Eigen::Matrix3d local = axes.transpose() * course.mean(d) * axes;
      size += course.count_at(d) / static_cast<double>(course.count()) *
              Eigen::Vector3d(1.5 * (local(0, 0) - local.trace() / 3), 0.5 * (local(1, 1) - local(2, 2)),
                              local(1, 2));
    }
    u_.setZero(static_cast<Eigen::Index>(unknowns_));
    for (size_t n = 0; n < lattice_.mesh.node_count(); ++n) {
      u_[static_cast<Eigen::Index>(fields * n + helix)] = angle_at(helices, lattice_.depth[n]);
      u_.segment<3>(static_cast<Eigen::Index>(fields * n + anisotropy)) = size;
    }
  }

  void evaluate(Datum& datum) const {
    const HermiteMesh& mesh = lattice_.mesh;
    datum.model.setZero();
    datum.slope.assign(datum.nodes.size(), Matrix5::Zero());
    const std::vector<WallSample>& samples = datum.voxel->samples;
    for (size_t s = 0; s < samples.size(); ++s) {
      const WallSample& sample = samples[s];
      const double share = sample.share;
      std::array<double, fields> here{};
      for (size_t c = 0; c < corners; ++c)
        for (size_t k = 0; k < fields; ++k)
          here[k] += sample.basis[c] * at(u_, mesh.element(sample.element)[c], k);
      const LocalModel local = local_model(sample.axes, here);
      datum.model += share * local.value;
      for (size_t c = 0; c < corners; ++c)
        datum.slope[datum.place[s][c]] += share * sample.basis[c] * local.slope;
    }
    // The voxel's size of anisotropy: fraction +- (1 - fraction), and a little even where it is whole.
    const double spread = std::hypot(1 - datum.fraction, size_slack);
    datum.information =
        (noise_ * datum.covariance + spread * spread * datum.model * datum.model.transpose()).inverse();
    const Vector5 residual = datum.seen - datum.fraction * datum.model;
    const double square = residual.dot(datum.information * residual);
    datum.weight = (student_freedom + 5) / (student_freedom + square);
  }

  void evaluate() {
    parallel_for(data_.size(), machine_threads(), [&](size_t i) { evaluate(data_[i]); });
  }

  void factorise() {
    for (Matrix5& block : blocks_)
      block.setZero();
    gradient_.setZero(u_.size());
    for (const Datum& datum : data_) {
      const double f = datum.fraction;
      const Matrix5 information = datum.weight * datum.information;
      const Vector5 pull = information * (datum.seen - f * datum.model);
      std::vector<Matrix5> weighted;
      for (const Matrix5& slope : datum.slope)
        weighted.push_back(f * f * information * slope);
      for (size_t i = 0; i < datum.nodes.size(); ++i) {
        gradient_.segment<5>(static_cast<Eigen::Index>(fields * datum.nodes[i])) +=
            f * datum.slope[i].transpose() * pull;
        for (size_t j = 0; j < datum.nodes.size(); ++j) {
          if (datum.nodes[i] < datum.nodes[j]) continue;
          const auto place =
              std::lower_bound(pattern_.begin(), pattern_.end(), key(datum.nodes[i], datum.nodes[j]));
          blocks_[static_cast<size_t>(place - pattern_.begin())] += datum.slope[i].transpose() * weighted[j];
        }
      }
    }
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(25 * blocks_.size() + unknowns_);
    for (size_t b = 0; b < blocks_.size(); ++b) {
      const auto row = static_cast<int>(fields * (pattern_[b] >> 32U)),
                 column = static_cast<int>(fields * (pattern_[b] & 0xffffffffU));
      for (int i = 0; i < 5; ++i)
        for (int j = 0; j < 5; ++j)
          if (row + i >= column + j) entries.emplace_back(column + j, row + i, blocks_[b](i, j));
    }
    for (Eigen::Index i = 0; i < holding_.size(); ++i)
      entries.emplace_back(static_cast<int>(i), static_cast<int>(i), holding_[i]);
    for (const Smoothness& smoothness : smoothness_) {
      for (size_t k = 0; k < 2; ++k) {
        for (const size_t field : smoothness.fields) {
          const Eigen::VectorXd bent = smoothness.strength[k] * (bends_[k] * field_of(u_, field));
          for (Eigen::Index n = 0; n < bent.size(); ++n)
            gradient_[static_cast<Eigen::Index>(fields) * n + static_cast<Eigen::Index>(field)] -= bent[n];
          for (Eigen::Index n = 0; n < bends_[k].outerSize(); ++n)
            for (Sparse::InnerIterator at(bends_[k], n); at; ++at)
              if (at.row() <= at.col())
                entries.emplace_back(
                    static_cast<int>(fields) * static_cast<int>(at.row()) + static_cast<int>(field),
                    static_cast<int>(fields) * static_cast<int>(at.col()) + static_cast<int>(field),
                    smoothness.strength[k] * at.value());
        }
      }
    }
    Sparse system(u_.size(), u_.size());
    system.setFromTriplets(entries.begin(), entries.end());
    for (Eigen::Index i = 0; i < holding_.size(); ++i)
      if (static_cast<size_t>(i) % fields != helix) gradient_[i] -= holding_[i] * u_[i];
    const auto entry_count = static_cast<size_t>(system.nonZeros());
    if (!matrix_pattern_) {  // it stays
      const int *starts = system.outerIndexPtr(), *rows = system.innerIndexPtr();
      matrix_pattern_ = CholeskyPattern::of({starts, starts + system.cols() + 1}, {rows, rows + entry_count});
    }
    factor_ =
        matrix_pattern_ ? CholeskyFactor::of(matrix_pattern_, {system.valuePtr(), entry_count}) : nullptr;
    if (!factor_) throw std::domain_error("the fibre field's equations have no solution");
  }

  /// Returns the angles' root mean square change.
  double step() {
    factorise();
    Eigen::VectorXd change = factor_->solve(gradient_);
    double longest = 0, squares = 0;
    for (size_t n = 0; n < lattice_.mesh.node_count(); ++n) {
      const double helices = at(change, n, helix), transverses = at(change, n, transverse);
      longest = std::max({longest, std::abs(helices), std::abs(transverses)});
      squares += helices * helices + transverses * transverses;
    }
    const double share = std::min(1.0, longest_step_rad / longest);
    u_ += share * change;
    return share * std::sqrt(squares / static_cast<double>(lattice_.mesh.node_count()));
  }

  /// Fellner-Schall: strengths and the noise's scale, by traces over random signs.
  void update_strengths() {
    const Eigen::MatrixXd solved = factor_->solve(signs_);
    double used = 0;
    constexpr double most_change = 10;
    for (Smoothness& smoothness : smoothness_) {
      // What no second difference feels is held by next to nothing.
      Sparse prior = smoothness.strength[0] * bends_[0] + smoothness.strength[1] * bends_[1];
      const double faint = 1e-7 * prior.diagonal().maxCoeff();
      for (Eigen::Index i = 0; i < prior.rows(); ++i)
        prior.coeffRef(i, i) += faint;
      const Eigen::SimplicialLDLT<Sparse> prior_factor(prior);
      std::array<double, 2> of_prior{}, of_posterior{}, bend{};
      for (const size_t field : smoothness.fields) {
        const Eigen::MatrixXd signs = field_of(signs_, field), here = field_of(solved, field);
        const Eigen::MatrixXd alone = prior_factor.solve(signs);
        const Eigen::VectorXd values = field_of(u_, field);
        for (size_t k = 0; k < 2; ++k) {
          const Eigen::MatrixXd bent = smoothness.strength[k] * (bends_[k] * signs);
          of_prior[k] += alone.cwiseProduct(bent).sum() / probes;
          of_posterior[k] += here.cwiseProduct(bent).sum() / probes;
          bend[k] += smoothness.strength[k] * values.dot(bends_[k] * values);
        }
      }
      for (size_t k = 0; k < 2; ++k) {
        used += of_posterior[k];
        const double ratio = std::max(of_prior[k] - of_posterior[k], 0.01) / std::max(bend[k], 1e-12);
        smoothness.strength[k] =
            std::clamp(smoothness.strength[k] * std::clamp(ratio, 1 / most_change, most_change), 1e-3, 1e9);
      }
    }
    used += holding_.dot(solved.cwiseProduct(signs_).rowwise().sum()) / probes;
    freedom_ = std::max(1.0, static_cast<double>(unknowns_) - used);
    double squares = 0;
    for (const Datum& datum : data_) {
      const Vector5 residual = datum.seen - datum.fraction * datum.model;
      squares += datum.weight * residual.dot(datum.information * residual);
    }
    const double left = std::max(5.0 * static_cast<double>(data_.size()) - freedom_, 1.0);
    noise_ = std::clamp(noise_ * std::clamp(squares / left, 0.05, 20.0), 1e-3, 1e6);
  }

  const FibreLattice& lattice_;
  size_t unknowns_;
  std::vector<Datum> data_;
  std::array<Sparse, 2> bends_;  ///< second differences in the wall, and through it
  std::vector<NodalLines::SecondDifference> differences_;
  std::vector<Smoothness> smoothness_;
  Eigen::VectorXd holding_;
  std::vector<uint64_t> pattern_;
  std::vector<Matrix5> blocks_;
  Eigen::VectorXd u_, gradient_;
  std::shared_ptr<const CholeskyPattern> matrix_pattern_;  ///< of the upper triangle
  std::unique_ptr<const CholeskyFactor> factor_;
  Eigen::MatrixXd signs_;
  double noise_ = 1, freedom_ = 0;
  int iterations_ = 0;
  bool converged_ = false;
};

/// On a collapsed edge, an apex, there are no wall axes: those a thousandth of an element beside it stand for them.
Eigen::Matrix3d axes_near(const HermiteMesh& mesh, MaterialPoint point) {
  const Eigen::Matrix3d axes = wall_axes(mesh, point);
  if (axes.allFinite()) return axes;
  for (double& xi : point.xi)
    xi = std::lerp(xi, 0.5, 1e-3);
  return wall_axes(mesh, point);
}

}  // namespace

FibreAt FibreEstimate::at(const MaterialPoint& point) const {
  const std::array<double, corners> basis = trilinear_basis(point.xi);
  const Eigen::Matrix3d wall = axes_near(lattice.mesh, point);
  const auto interpolated = [&](const std::vector<FibreAngles>& of) {
    FibreAngles sum;
    for (size_t c = 0; c < corners; ++c) {
      const FibreAngles& node = of[lattice.mesh.element(point.element)[c]];
      sum.helix_deg += basis[c] * node.helix_deg;
      sum.transverse_deg += basis[c] * node.transverse_deg;
    }
    return sum;
  };
  const auto direction = [&](const FibreAngles& a) -> Eigen::Vector3d {
    return wall * triad(rad_per_deg * a.helix_deg, rad_per_deg * a.transverse_deg).col(0);
  };
  FibreAt found;
  found.angles = interpolated(nodes);
  found.direction = direction(found.angles);
  double squares = 0, helix_squares = 0;
  for (const auto& draw : draws) {
    const FibreAngles drawn = interpolated(draw);
    const double cosine = std::min(1.0, std::abs(direction(drawn).dot(found.direction)));
    squares += std::pow(std::acos(cosine) / rad_per_deg, 2);
    helix_squares += std::pow(drawn.helix_deg - found.angles.helix_deg, 2);
  }
  const double count = std::max<double>(1, static_cast<double>(draws.size()));
  found.sigma_deg = std::sqrt(squares / count);
  found.helix_sigma_deg = std::sqrt(helix_squares / count);
  return found;
}

FibreEstimate estimate_fibres(FibreLattice lattice, const std::vector<WallVoxel>& voxels,
                              const std::string& folder,
                              const std::function<void(const std::string&)>& stage) {
  if (voxels.size() < least_voxels)
    throw InputError(
        {folder, "", fmt::format("{} voxels lie in the wall of the mesh", voxels.size()),
         "The mesh must be in the images' patient coordinates: give a mesh made from images of the same "
         "session, or a study with [images.to_specimen]."});
  if (stage) stage(fmt::format("Fitting the fibre field to {} voxels.", voxels.size()));
  Estimation estimation(lattice, voxels);
  estimation.run();
  return estimation.result(lattice);
}

}  // namespace diastole::imaging
