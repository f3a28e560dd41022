#include "estimator/imaging/flow/lumen_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <tuple>

#include "estimator/parallel/kept_memory.hpp"
#include "estimator/parallel/parallel_for.hpp"

namespace diastole::imaging {
namespace {

/// A start a pixel off settles within ten; a wall or a place that is further off is approached in steps of a pixel.
constexpr int most_iterations = 30;
/// Of damping, each five times as hard.
constexpr int most_attempts = 8;
/// Steps of the scene end when chi-square falls by less than this: a small part of what one unknown's error changes it by.
constexpr double settled = 0.05;
/// Below that many standard deviations of its mean over the cycle a magnitude is mostly noise.
constexpr double least_magnitude = 4.0;
/// Significance of a movement of the lumen, as of chi-square.
constexpr double movement_z = 4.0;
/// A core slower than a quarter turn is beyond doubt.
constexpr double sure_rad = 0.5 * std::numbers::pi;

/// Of the scene, by which its derivatives are taken.
Eigen::VectorXd difference_steps(const LumenScene& scene, double pixel_mm) {
  Eigen::VectorXd steps(LumenScene::size);
  const double bright = std::max(scene.brightness.fluid[0], scene.brightness.still);
  steps << 0.03 * pixel_mm, 0.03 * pixel_mm, 0.03 * pixel_mm, 0.003, 0.003, 0.03 * pixel_mm, 0.01 * bright,
      1e-4, 1e-4, 0.01 * bright, 0.01 * bright, 0.01 * bright, 0.01 * bright;
  return steps;
}

/// Weak: what lies far beyond them is no lumen that this model describes.
Eigen::VectorXd prior_sd(const LumenScene& scene, double pixel_mm) {
  Eigen::VectorXd sd(LumenScene::size);
  const double bright = std::max(scene.brightness.fluid[0], scene.brightness.still);
  sd << 10 * pixel_mm, 10 * pixel_mm, 10 * pixel_mm, 0.3, 0.3, 5 * pixel_mm, bright, 0.02, 0.02, bright,
      bright, bright, 0.3 * bright;
  return sd;
}

/// Normal equations of one phase: of its own unknowns (profile, then movement), of the scene, and between them.
struct PhaseNormal {
  Eigen::MatrixXd own, between, scene;
  Eigen::VectorXd own_right, scene_right;
  double chi_square = 0;
};

class Fitter {
 public:
  Fitter(const LumenData& data, const LumenStart& start, Encoding encoding)
      : data_(data),
        model_(data.plane, start.scene.shape, data.measured_share, farthest(start.moved_mm)),
        scene_(start.scene),
        moved_mm_(start.moved_mm),
        encoding_(encoding) {
    pixel_mm_ = data.plane.finer_spacing_mm();
    prior_sd_ = prior_sd(scene_, pixel_mm_);
    prior_mean_ = scene_.vector();
    const Eigen::Index rows = model_.rows(), columns = model_.columns();
    Eigen::ArrayXXd mean = Eigen::ArrayXXd::Zero(rows, columns);
    for (size_t k = 0; k < phases(); ++k) {
      magnitude_.push_back(window(data.magnitude[k]));
      phase_.push_back(window(data.phase_rad[k]));
      mean += magnitude_.back() / static_cast<double>(phases());
    }
    // Noise alone has a mean of 1.25 of its channels' deviations, which are root two times the magnitude's.
    counts_ = (mean > least_magnitude * std::numbers::sqrt2 * data.noise.magnitude).cast<double>();
    used_ = 2 * counts_.sum() * static_cast<double>(phases());
    for (size_t k = 0; k < phases(); ++k)
      shapes_.push_back(shape_by_scene(k));
  }

  void start_profiles(const std::vector<double>& core_rad) {
    profiles_.resize(phases());
    parallel_for(phases(), machine_threads(), [&](size_t k) {
      profiles_[k] = settled_profile(k, core_rad[k], model_.grid(shapes_[k])).first;
    });
  }

  /// Gauss-Newton over everything, damped where it fails (Levenberg and Marquardt).
  bool run() {
    double before = linearise(), last = 0;
    double damping = 0;
    for (int iteration = 0; iteration < most_iterations; ++iteration) {
      const State kept{scene_, profiles_, shapes_};
      double now = std::numeric_limits<double>::infinity();
      for (int attempt = 0; attempt < most_attempts; ++attempt) {
        const auto [scene_step, own_steps] = newton_step(damping);
        advance(scene_step, own_steps);
        now = chi_square();
        if (now <= before + settled) break;
        std::tie(scene_, profiles_, shapes_) = std::tie(kept.scene, kept.profiles, kept.shapes);
        damping = damping > 0 ? 5 * damping : 0.01;
      }
      // Where only short steps are left it has ended if long ones promise nothing.
      if (now > before + settled) return promised_fall() < by_chance();
      linearise();
      if (before - now < settled) return damping == 0 || promised_fall() < by_chance();
      damping = damping > 0.005 ? 0.2 * damping : 0;
      last = before - now;
      before = now;
    }
    return last < by_chance();
  }

  /// Whether the lumen was seen to move, or phases pull it away from the common place by more than noise does. Then they get places of their own.
  bool let_move_if_it_does() {
    double pull = 0, freedom = 0;
    for (size_t k = 0; k < phases(); ++k) {
      const Eigen::MatrixXd solved = normals_[k].own.ldlt().solve(normals_[k].between);
      const Eigen::MatrixXd left =
          (normals_[k].scene - normals_[k].between.transpose() * solved).topLeftCorner(3, 3);
      const Eigen::VectorXd right =
          (normals_[k].scene_right - solved.transpose() * normals_[k].own_right).head(3);
      pull += right.dot(left.ldlt().solve(right));
      freedom += 3;
    }
    const double reduced = std::max(1.0, chi_square_ / freedom_left());
    const double third = 2.0 / (9.0 * freedom);
    moves_ =
        !moved_mm_.empty() || std::cbrt(pull / reduced / freedom) > 1 - third + movement_z * std::sqrt(third);
    return moves_;
  }

  /// Whether the core of a phase may have a turn more or less, and how much worse that fits.
  bool try_turns(std::vector<double>& margin) {
    margin.assign(phases(), std::numeric_limits<double>::infinity());
    std::vector<std::optional<Eigen::VectorXd>> better(phases());
    const double reduced = std::max(1.0, chi_square_ / freedom_left());
    parallel_for(phases(), machine_threads(), [&](size_t k) {
      const double core = core_rad(k);
      if (std::abs(core) < sure_rad) return;
      const LumenGrid grid = model_.grid(shapes_[k]);
      const double own = compared(k, grid, profiles_[k], nullptr).second;
      const auto [profile, chi_square] = settled_profile(k, core - std::copysign(turn, core), grid);
      margin[k] = (chi_square - own) / reduced;
      if (chi_square < own) better[k] = profile;
    });
    bool any = false;
    for (size_t k = 0; k < phases(); ++k) {
      if (!better[k]) continue;
      profiles_[k] = *better[k];
      any = true;
    }
    return any;
  }

  LumenFit result() {
    LumenFit fit;
    fit.scene = scene_;
    fit.encoding = encoding_;
    fit.profiles = profiles_;
    fit.shapes = shapes_;
    fit.moves = moves_;
    fit.reduced_chi_square = chi_square_ / freedom_left();
    const double mL_s_per_rad_mm2 = 0.01 * data_.cm_s_per_radian;
    const auto count = static_cast<Eigen::Index>(phases());
    fit.flow_mL_s.resize(count);
    Eigen::MatrixXd by_scene(count, LumenScene::size);
    Eigen::VectorXd own_variance(count);
    const Eigen::MatrixXd scene_covariance = scene_normal().inverse();
    const Eigen::VectorXd steps = difference_steps(scene_, pixel_mm_);
    std::vector<Eigen::VectorXd> integrals_by_shape;
    for (size_t k = 0; k < phases(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      const LumenGrid grid = model_.grid(shapes_[k]);
      fit.velocity_chi_square +=
          compared(k, grid, profiles_[k], nullptr).first.head(counts_.size()).squaredNorm() /
          (0.5 * freedom_left());
      const Eigen::VectorXd integrals = model_.integrals_mm2(grid);
      if (k == 0) fit.area_mm2 = model_.area_mm2(grid);
      fit.flow_mL_s[at] = mL_s_per_rad_mm2 * integrals.dot(profiles_[k]);
      if (k == 0 || !is_common()) {
        integrals_by_shape.clear();
        for (Eigen::Index i = 0; i < LumenScene::shape_size; ++i)
          integrals_by_shape.push_back(
              (model_.integrals_mm2(model_.grid(shifted_shape(shapes_[k], i, steps[i]))) - integrals) /
              steps[i]);
      }
      Eigen::VectorXd direct = Eigen::VectorXd::Zero(LumenScene::size);
      for (Eigen::Index i = 0; i < LumenScene::shape_size; ++i)
        direct[i] = integrals_by_shape[static_cast<size_t>(i)].dot(profiles_[k]);
      Eigen::VectorXd by_own = Eigen::VectorXd::Zero(normals_[k].own.rows());
      by_own.head(integrals.size()) = integrals;
      if (moves_) by_own.tail(3) = direct.head(3);
      if (moves_) direct.head(3).setZero();
      const auto factor = normals_[k].own.ldlt();
      own_variance[at] = by_own.dot(factor.solve(by_own));
      by_scene.row(at) = (direct - normals_[k].between.transpose() * factor.solve(by_own)).transpose();
      fit.core_cm_s.push_back(data_.cm_s_per_radian * core_rad(k));
      fit.phase_chi_square.push_back(normals_[k].chi_square * static_cast<double>(phases()) / freedom_left());
    }
    fit.covariance = by_scene * scene_covariance * by_scene.transpose();
    fit.covariance += own_variance.asDiagonal();
    // Zeros in the spectrum bring pixels, but no more measurements.
    fit.covariance *= std::max(1.0, fit.reduced_chi_square) / data_.measured_share.prod() * mL_s_per_rad_mm2 *
                      mL_s_per_rad_mm2;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const LumenShape& shape : shapes_)
      mean += shape.centre_mm / static_cast<double>(phases());
    for (const LumenShape& shape : shapes_)
      fit.movement_mm += (shape.centre_mm - mean).squaredNorm() / static_cast<double>(phases());
    fit.movement_mm = std::sqrt(fit.movement_mm);
    if (moves_) {
      fit.scene.shape.centre_mm = mean;
      fit.scene.shape.radius_mm = 0;
      for (const LumenShape& shape : shapes_)
        fit.scene.shape.radius_mm += shape.radius_mm / static_cast<double>(phases());
    }
    return fit;
  }

 private:
  struct State {
    LumenScene scene;
    std::vector<Eigen::VectorXd> profiles;
    std::vector<LumenShape> shapes;
  };

  [[nodiscard]] size_t phases() const { return data_.magnitude.size(); }
  [[nodiscard]] double freedom_left() const {
    return std::max(1.0, used_ - static_cast<double>(phases()) * static_cast<double>(model_.profile_size()));
  }
  /// A tenth of what chi-square differs by from one noise to another.
  [[nodiscard]] double by_chance() const { return 0.1 * std::sqrt(2 * freedom_left()); }
  [[nodiscard]] Eigen::ArrayXXd window(const Image& image) const {
    return image.block(model_.first_row(), model_.first_column(), model_.rows(), model_.columns())
        .cast<double>();
  }
  [[nodiscard]] double core_rad(size_t k) const { return profiles_[k][model_.profile_size() - 3]; }

  /// Whether one grid serves all phases.
  [[nodiscard]] bool is_common() const { return !moves_ && moved_mm_.empty(); }
  [[nodiscard]] LumenShape shape_by_scene(size_t k) const {
    LumenShape shape = scene_.shape;
    if (!moved_mm_.empty()) shape.centre_mm += moved_mm_[k];
    return shape;
  }
  static Eigen::Vector2d farthest(const std::vector<Eigen::Vector2d>& moved_mm) {
    Eigen::Vector2d most = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& moved : moved_mm)
      most = most.cwiseMax(moved.cwiseAbs());
    return most;
  }

  static LumenShape shifted_shape(LumenShape shape, Eigen::Index unknown, double step) {
    Eigen::VectorXd vector = LumenScene{shape, {}}.vector();
    vector[unknown] += step;
    return LumenScene::from(vector).shape;
  }

  /// Weighted residuals of a phase, magnitudes below phases, and the sum of their squares.
  std::pair<Eigen::VectorXd, double> compared(size_t k, const LumenGrid& grid, const Eigen::VectorXd& profile,
                                              std::vector<LumenImage>* slopes) const {
    const LumenImage image = model_.image(grid, scene_.brightness, encoding_, profile, slopes);
    return residuals(k, image);
  }
  [[nodiscard]] std::pair<Eigen::VectorXd, double> residuals(size_t k, const LumenImage& image) const {
    const Eigen::Index pixels = counts_.size();
    Eigen::VectorXd left(2 * pixels);
    for (Eigen::Index i = 0; i < pixels; ++i) {
      const double counts = counts_.data()[i];
      left[i] = counts * magnitude_[k].data()[i] / data_.noise.magnitude_times_phase *
                within_half_turn(phase_[k].data()[i] - image.phase_rad.data()[i]);
      left[pixels + i] =
          counts * (magnitude_[k].data()[i] - image.magnitude.data()[i]) / data_.noise.magnitude;
    }
    return {left, left.squaredNorm()};
  }
  /// A derivative of phases and magnitudes, weighted as residuals are.
  [[nodiscard]] Eigen::VectorXd weighted(size_t k, const Eigen::ArrayXXd& phase,
                                         const Eigen::ArrayXXd& magnitude) const {
    const Eigen::Index pixels = counts_.size();
    Eigen::VectorXd column(2 * pixels);
    for (Eigen::Index i = 0; i < pixels; ++i) {
      column[i] =
          counts_.data()[i] * magnitude_[k].data()[i] / data_.noise.magnitude_times_phase * phase.data()[i];
      column[pixels + i] = counts_.data()[i] / data_.noise.magnitude * magnitude.data()[i];
    }
    return column;
  }
  [[nodiscard]] Eigen::MatrixXd profile_columns(size_t k, const std::vector<LumenImage>& slopes) const {
    Eigen::MatrixXd columns(2 * counts_.size(), static_cast<Eigen::Index>(slopes.size()));
    for (size_t j = 0; j < slopes.size(); ++j)
      columns.col(static_cast<Eigen::Index>(j)) = weighted(k, slopes[j].phase_rad, slopes[j].magnitude);
    return columns;
  }
  /// Keeps knots that no pixel sees from running away.
  static void hold(Eigen::MatrixXd& normal) {
    normal.diagonal().array() += 1e-6 * normal.trace() / static_cast<double>(normal.rows());
  }

  /// The profile alone, with the scene as it is, from boundary layers of several widths: where the velocity wraps within one, a start on the wrong side of
  /// a wrap stays there.
  [[nodiscard]] std::pair<Eigen::VectorXd, double> settled_profile(size_t k, double core,
                                                                   const LumenGrid& grid) const {
    std::pair<Eigen::VectorXd, double> best = settled_from(k, core, 0, grid);
    if (std::abs(core) < sure_rad) return best;
    for (const double layer_px : {0.5, 1.0, 2.0}) {
      auto other = settled_from(k, core, layer_px * pixel_mm_, grid);
      if (other.second < best.second) best = std::move(other);
    }
    return best;
  }
  [[nodiscard]] std::pair<Eigen::VectorXd, double> settled_from(size_t k, double core, double layer_mm,
                                                                const LumenGrid& grid) const {
    Eigen::VectorXd profile = model_.layer_profile(core, layer_mm);
    double least = std::numeric_limits<double>::infinity();
    for (int iteration = 0; iteration < 6; ++iteration) {
      std::vector<LumenImage> slopes;
      const auto [left, chi_square] = compared(k, grid, profile, &slopes);
      if (iteration > 1 && chi_square > least - settled) return {profile, std::min(least, chi_square)};
      least = chi_square;
      const Eigen::MatrixXd columns = profile_columns(k, slopes);
      Eigen::MatrixXd normal = columns.transpose() * columns;
      hold(normal);
      profile += normal.ldlt().solve(columns.transpose() * left);
    }
    return {profile, compared(k, grid, profile, nullptr).second};
  }

  double chi_square() const {
    std::vector<double> each(phases());
    const LumenGrid common = model_.grid(scene_.shape);
    parallel_for(phases(), machine_threads(), [&](size_t k) {
      each[k] = compared(k, is_common() ? common : model_.grid(shapes_[k]), profiles_[k], nullptr).second;
    });
    double sum = (scene_.vector() - prior_mean_).cwiseQuotient(prior_sd_).squaredNorm();
    for (const double one : each)
      sum += one;
    return sum;
  }

  /// Fills the normal equations; returns chi-square.
  double linearise() {
    const Eigen::VectorXd steps = difference_steps(scene_, pixel_mm_);
    normals_.assign(phases(), {});
    std::vector<LumenGrid> common;
    if (is_common()) common = grids_around(scene_.shape, steps);
    parallel_for(phases(), machine_threads(), [&](size_t k) {
      linearise_phase(k, is_common() ? common : grids_around(shapes_[k], steps), steps);
    });
    chi_square_ = (scene_.vector() - prior_mean_).cwiseQuotient(prior_sd_).squaredNorm();
    for (const PhaseNormal& normal : normals_)
      chi_square_ += normal.chi_square;
    return chi_square_;
  }
  [[nodiscard]] std::vector<LumenGrid> grids_around(const LumenShape& shape,
                                                    const Eigen::VectorXd& steps) const {
    std::vector<LumenGrid> grids{model_.grid(shape)};
    for (Eigen::Index i = 0; i < LumenScene::shape_size; ++i)
      grids.push_back(model_.grid(shifted_shape(shape, i, steps[i])));
    return grids;
  }

  void linearise_phase(size_t k, const std::vector<LumenGrid>& grids, const Eigen::VectorXd& steps) {
    std::vector<LumenImage> slopes;
    const LumenImage image = model_.image(grids[0], scene_.brightness, encoding_, profiles_[k], &slopes);
    const auto [left, chi_square] = residuals(k, image);
    Eigen::MatrixXd scene(left.size(), LumenScene::size);
    for (Eigen::Index i = 0; i < LumenScene::size; ++i) {
      const bool is_shape = i < LumenScene::shape_size;
      Eigen::VectorXd vector = scene_.vector();
      vector[i] += steps[i];
      const LumenImage there = model_.image(is_shape ? grids[static_cast<size_t>(i) + 1] : grids[0],
                                            LumenScene::from(vector).brightness, encoding_, profiles_[k]);
      scene.col(i) = weighted(k, (there.phase_rad - image.phase_rad).unaryExpr([](double x) {
        return within_half_turn(x);
      }) / steps[i],
                              (there.magnitude - image.magnitude) / steps[i]);
    }
    Eigen::MatrixXd own = profile_columns(k, slopes);
    if (moves_) {
      own.conservativeResize(Eigen::NoChange, own.cols() + 3);
      own.rightCols(3) = scene.leftCols(3);
      scene.leftCols(3).setZero();
    }
    PhaseNormal& normal = normals_[k];
    normal.own = own.transpose() * own;
    hold(normal.own);
    normal.between = own.transpose() * scene;
    normal.scene = scene.transpose() * scene;
    normal.own_right = own.transpose() * left;
    normal.scene_right = scene.transpose() * left;
    normal.chi_square = chi_square;
  }

  /// Of the scene alone, each phase's own unknowns eliminated; all damped in proportion to their own sizes.
  [[nodiscard]] Eigen::MatrixXd scene_normal(double damping = 0) const {
    Eigen::MatrixXd normal = prior_sd_.array().square().inverse().matrix().asDiagonal();
    for (const PhaseNormal& phase : normals_) {
      normal += phase.scene;
      normal.diagonal() += damping * phase.scene.diagonal();
      normal -= phase.between.transpose() * damped(phase.own, damping).ldlt().solve(phase.between);
    }
    return normal;
  }
  static Eigen::MatrixXd damped(Eigen::MatrixXd normal, double damping) {
    normal.diagonal() *= 1 + damping;
    return normal;
  }
  [[nodiscard]] Eigen::VectorXd scene_right(double damping) const {
    Eigen::VectorXd right = (prior_mean_ - scene_.vector()).cwiseQuotient(prior_sd_.cwiseAbs2());
    for (const PhaseNormal& phase : normals_)
      right += phase.scene_right -
               phase.between.transpose() * damped(phase.own, damping).ldlt().solve(phase.own_right);
    return right;
  }
  /// Of chi-square, by the undamped step, if the model were linear.
  [[nodiscard]] double promised_fall() const {
    const Eigen::VectorXd right = scene_right(0);
    const Eigen::VectorXd step = within_bounds(scene_normal(), right);
    double fall = (2 * right - scene_normal() * step).dot(step);
    for (const PhaseNormal& phase : normals_)
      fall += phase.own_right.dot(phase.own.ldlt().solve(phase.own_right));
    return fall;
  }
  [[nodiscard]] std::pair<Eigen::VectorXd, std::vector<Eigen::VectorXd>> newton_step(double damping) const {
    const Eigen::VectorXd step = within_bounds(scene_normal(damping), scene_right(damping));
    std::vector<Eigen::VectorXd> own;
    for (const PhaseNormal& phase : normals_)
      own.push_back(damped(phase.own, damping).ldlt().solve(phase.own_right - phase.between * step));
    return {step, own};
  }
  /// The step of the scene: what it would take beyond a bound ends there, and the rest is solved again.
  [[nodiscard]] Eigen::VectorXd within_bounds(const Eigen::MatrixXd& normal,
                                              const Eigen::VectorXd& right) const {
    const Eigen::VectorXd room = scene_.vector() - least_scene();
    std::vector<Eigen::Index> free(LumenScene::size);
    std::iota(free.begin(), free.end(), 0);
    Eigen::VectorXd step = Eigen::VectorXd::Zero(LumenScene::size);
    while (!free.empty()) {
      const Eigen::VectorXd left = right - normal * step;
      step(free) += Eigen::MatrixXd(normal(free, free)).ldlt().solve(Eigen::VectorXd(left(free)));
      const size_t before = free.size();
      std::erase_if(free, [&](Eigen::Index i) { return step[i] < -room[i]; });
      if (free.size() == before) break;
      for (Eigen::Index i = 0; i < step.size(); ++i)
        step[i] = std::max(step[i], -room[i]);
    }
    return step;
  }
  [[nodiscard]] Eigen::VectorXd least_scene() const {
    Eigen::VectorXd least =
        Eigen::VectorXd::Constant(LumenScene::size, -std::numeric_limits<double>::infinity());
    least[2] = pixel_mm_;
    least[5] = least[6] = least[12] = 0;
    return least;
  }
  void advance(const Eigen::VectorXd& scene_step, const std::vector<Eigen::VectorXd>& own_steps) {
    scene_ = LumenScene::from((scene_.vector() + scene_step).cwiseMax(least_scene()));
    for (size_t k = 0; k < phases(); ++k) {
      const Eigen::VectorXd& step = own_steps[k];
      profiles_[k] += step.head(model_.profile_size());
      const LumenShape before = shapes_[k];
      shapes_[k] = shape_by_scene(k);
      if (!moves_) continue;
      shapes_[k].centre_mm = before.centre_mm + step.segment(model_.profile_size(), 2);
      shapes_[k].radius_mm = before.radius_mm + step[model_.profile_size() + 2];
    }
  }

  const LumenData& data_;
  LumenModel model_;
  LumenScene scene_;
  std::vector<Eigen::Vector2d> moved_mm_;
  Encoding encoding_;
  double pixel_mm_ = 1;
  Eigen::VectorXd prior_mean_, prior_sd_;
  std::vector<Eigen::ArrayXXd> magnitude_, phase_;
  Eigen::ArrayXXd counts_;  // 1 where a pixel is compared
  double used_ = 0;
  std::vector<Eigen::VectorXd> profiles_;
  std::vector<LumenShape> shapes_;
  bool moves_ = false;
  std::vector<PhaseNormal> normals_;
  double chi_square_ = 0;
};

/// Begins where a fit has ended.
LumenStart continued(const LumenFit& fit, const LumenStart& start) {
  LumenStart next{fit.scene, {}, start.core_rad};
  if (!fit.moves) return next;
  for (const LumenShape& shape : fit.shapes)
    next.moved_mm.push_back(shape.centre_mm - fit.scene.shape.centre_mm);
  return next;
}

LumenFit fitted(const LumenData& data, const LumenStart& start, Encoding encoding) {
  Fitter fitter(data, start, encoding);
  fitter.start_profiles(start.core_rad);
  bool converged = fitter.run();
  std::vector<double> margin;
  const auto put_turns_right = [&] {
    for (int round = 0; round < 2 && fitter.try_turns(margin); ++round)
      converged = fitter.run();
  };
  put_turns_right();
  if (fitter.let_move_if_it_does()) {
    converged = fitter.run();
    // Of a lumen that is out of its place the profile determines no turns.
    put_turns_right();
  }
  LumenFit fit = fitter.result();
  fit.converged = converged;
  fit.turn_margin = margin;
  return fit;
}

}  // namespace

LumenFit fit_lumen(const LumenData& data, const LumenStart& start) {
  keep_freed_memory();
  LumenFit best = fitted(data, start, Encoding::separate);
  const auto try_other = [&](LumenFit other) {
    if (other.reduced_chi_square < best.reduced_chi_square) best = std::move(other);
  };
  if (!best.describes_images()) {
    // A vessel in tissue has no wall without signal, and from a wide one no step leads there.
    LumenStart bare = start;
    bare.scene.shape.wall_mm = 0;
    try_other(fitted(data, bare, Encoding::separate));
  }
  try_other(fitted(data, continued(best, start), Encoding::balanced));
  return best;
}

}  // namespace diastole::imaging
