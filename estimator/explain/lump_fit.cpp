#include "estimator/explain/lump_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "estimator/explain/lump_body.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;

constexpr double ci90 = 1.6449;
constexpr double usual_axis_mm = 10.0;
// Weak priors, of the logarithms: few data tell size from contrast.
constexpr double axis_spread = 0.35;
constexpr double contrast_spread = 1.0;
constexpr Index priors = 4;

/// The motion that a change of C1 makes grows faster than the pressure; so does that of a lump.
std::vector<double> course_of_stiffness(const FieldFit& base, const FieldRows& rows, double highest_kPa) {
  std::vector<double> course;
  for (size_t slot = 0; slot < base.pressures_kPa.size(); ++slot)
    course.push_back(base.jacobian.col(0).segment(rows.first(slot), rows.count(slot)).norm() /
                     std::sqrt(static_cast<double>(std::max<Index>(1, rows.count(slot)))));
  const auto loudest =
      static_cast<size_t>(std::ranges::max_element(base.pressures_kPa) - base.pressures_kPa.begin());
  const double there = course[loudest] * highest_kPa / base.pressures_kPa[loudest];
  for (double& share : course)
    share /= there;
  return course;
}

/// In the parameters' coordinates.
using Intervals = std::array<std::array<double, 2>, lump_parameters>;

/// `base` with the guess beside it, not fitted.
FieldFit with_lump(const FieldFit& base, const Inclusion& guess) {
  FieldFit result = base;
  result.converged = false;
  result.choice =
      together(base.choice, {{&lump_effect()},
                             {guess.contrast, guess.radius_mm, guess.z_mm, guess.theta_deg,
                              guess.semi_axes_mm[0], guess.semi_axes_mm[1], guess.semi_axes_mm[2]},
                             {0, 1, 2, 3, 4, 5, 6}});
  return result;
}

/// A ball there: where a guess's contrast and axes have gone astray together, the better valley may begin here.
Inclusion usual_lump(const Inclusion& guess) {
  constexpr double usual_contrast = 3.0;
  Inclusion usual = guess;
  usual.contrast = guess.contrast > 1.0 ? usual_contrast : 1.0 / usual_contrast;
  usual.semi_axes_mm = {usual_axis_mm, usual_axis_mm, usual_axis_mm};
  return usual;
}

class LumpFit {
 public:
  LumpFit(const FieldProblem& problem, const FieldFit& base, const Inclusion& guess)
      : base_(base),
        body_(problem.field().base, base.C1_kPa, problem.nodes_kPa().back(), guess),
        rows_(problem.rows().relocated(
            PointLocator(body_.mesh(), body_.mesh().reference(), problem.field().locator))),
        course_(course_of_stiffness(base, problem.rows(), problem.nodes_kPa().back())) {}

  /// Downhill from a lump, until a step gains less than `tolerance` of chi2; the best one so far is kept.
  void descend(const Inclusion& from, double tolerance) {
    Point at = evaluate({from.contrast, from.radius_mm, from.z_mm, from.theta_deg, from.semi_axes_mm[0],
                         from.semi_axes_mm[1], from.semi_axes_mm[2]},
                        Eigen::VectorXd::Zero(base_.jacobian.cols()));
    if (!std::isfinite(at.cost())) return;
    const bool converged = minimise(at, false, tolerance);
    if (begun_ && at.cost() >= best_.cost()) return;
    best_ = std::move(at);
    converged_ = converged;
    begun_ = true;
  }

  /// The best lump so far; the guess, not converged, if there is none.
  [[nodiscard]] FieldFit result(const Inclusion& guess) const {
    FieldFit found = with_lump(base_, guess);
    if (!begun_) return found;
    found.converged = converged_;
    finish(best_, found);
    return found;
  }

  /// 90 % intervals of the parameters' coordinates. Contrast, size and depth trade off against one another, not always
  /// within one valley: the others are refitted at held contrasts on both sides, until that costs 2.7 of chi2, and every
  /// parameter's interval is what all these fits leave open. A held fit in a deeper valley than the best one's replaces it,
  /// and the profile begins again there. Precondition: `descend` has found a lump.
  [[nodiscard]] Intervals intervals(double tolerance) {
    constexpr int valleys = 4;
    for (int valley = 1; valley < valleys; ++valley) {
      const Profile profile = profile_of_contrast(tolerance);
      if (!profile.deeper) return profile.intervals;
      best_ = *profile.deeper;
      converged_ = minimise(best_, false, tolerance);
    }
    return profile_of_contrast(std::numeric_limits<double>::infinity()).intervals;
  }

 private:
  struct Point {
    LumpValues values{};
    Eigen::VectorXd shift;      // of log C1 and the pressures, from the base fit
    Eigen::VectorXd residuals;  // rows, the base fit's priors, the lump's priors
    Eigen::MatrixXd jacobian;   // lump parameters, then shift
    [[nodiscard]] double cost() const { return residuals.squaredNorm(); }
  };

  struct Profile {
    Intervals intervals{};
    std::optional<Point> deeper;  // where it ended, if there
  };

  static constexpr double allowed = 2.706;  // of chi2: 90 % of one parameter

  /// Ends at a fit that is better than the best one by more than `gain`.
  [[nodiscard]] Profile profile_of_contrast(double gain) {
    Profile profile{open_at(best_, 0.0), {}};
    Intervals& found = profile.intervals;
    const double start = coordinates(best_)[0];
    const double usual = std::clamp(std::sqrt(conditional(best_, false)(0, 0)), 0.08, 0.6);
    for (const double direction : {-1.0, 1.0}) {
      Point at = best_;
      double cost_before = 0.0;
      std::array<double, lump_parameters> before = coordinates(best_);
      for (double away = usual; away < 6.0 * usual; away *= 1.6) {
        at.values[0] = std::clamp(std::exp(start + direction * away), parameter(0).lower, parameter(0).upper);
        at = evaluate(at.values, at.shift);
        (void)minimise(at, true, 0.2);
        if (at.cost() < best_.cost() - gain) {
          profile.deeper = std::move(at);
          return profile;
        }
        const std::array<double, lump_parameters> here = coordinates(at);
        const double cost = std::max(0.0, at.cost() - best_.cost());
        if (cost >= allowed) {
          const double part =
              (std::sqrt(allowed) - std::sqrt(cost_before)) / (std::sqrt(cost) - std::sqrt(cost_before));
          for (size_t i = 0; i < lump_parameters; ++i) {
            const double crossing = std::lerp(before[i], here[i], part);
            widen(found[i], {crossing, crossing});
          }
          break;
        }
        widen(found, open_at(at, cost));
        widen(found[0], {here[0], here[0]});
        before = here;
        cost_before = cost;
        if (at.values[0] == parameter(0).lower || at.values[0] == parameter(0).upper) break;
      }
    }
    return profile;
  }

  [[nodiscard]] static const EffectParameter& parameter(size_t i) {
    return lump_effect().field_parameters()[i];
  }

  [[nodiscard]] std::array<double, lump_parameters> coordinates(const Point& at) const {
    std::array<double, lump_parameters> result{};
    for (size_t i = 0; i < lump_parameters; ++i)
      result[i] = to_coordinate(parameter(i), at.values[i]);
    return result;
  }

  /// Covariance of the lump's parameters, all else free; with the contrast held its own row and column are nearly zero.
  [[nodiscard]] static Eigen::MatrixXd conditional(const Point& at, bool hold_contrast) {
    Eigen::MatrixXd normal = at.jacobian.transpose() * at.jacobian;
    if (hold_contrast) normal(0, 0) += 1e12;
    return normal.inverse().topLeftCorner<lump_parameters, lump_parameters>();
  }

  /// What a point of the profile leaves open for each parameter when it costs so much already.
  [[nodiscard]] Intervals open_at(const Point& at, double cost) const {
    const Eigen::MatrixXd covariance = conditional(at, true);
    const std::array<double, lump_parameters> here = coordinates(at);
    Intervals result{};
    for (size_t i = 0; i < lump_parameters; ++i) {
      const auto k = static_cast<Index>(i);
      const double half = std::sqrt((allowed - cost) * std::max(0.0, covariance(k, k)));
      result[i] = {here[i] - half, here[i] + half};
    }
    return result;
  }

  static void widen(std::array<double, 2>& interval, const std::array<double, 2>& by) {
    interval = {std::min(interval[0], by[0]), std::max(interval[1], by[1])};
  }
  static void widen(Intervals& intervals, const Intervals& by) {
    for (size_t i = 0; i < lump_parameters; ++i)
      widen(intervals[i], by[i]);
  }

  /// Levenberg-Marquardt from a point. Whether it converged.
  [[nodiscard]] bool minimise(Point& best, bool hold_contrast, double tolerance) {
    constexpr double hardly_damped = 0.1;
    double damping = 1e-3;
    bool converged = false;
    for (int iteration = 0; iteration < 12 && !converged; ++iteration) {
      Eigen::MatrixXd normal = best.jacobian.transpose() * best.jacobian;
      Eigen::VectorXd gradient = best.jacobian.transpose() * best.residuals;
      if (hold_contrast) {
        normal.row(0).setZero();
        normal.col(0).setZero();
        normal(0, 0) = 1.0;
        gradient[0] = 0.0;
      }
      const double promised = gradient.dot(normal.ldlt().solve(gradient));
      normal.diagonal() *= 1.0 + damping;
      const Eigen::VectorXd step = -normal.ldlt().solve(gradient);
      Point trial = evaluate(moved(best.values, step.head<lump_parameters>()),
                             best.shift + step.tail(best.shift.size()));
      if (trial.cost() < best.cost()) {
        converged = best.cost() - trial.cost() < tolerance && damping < hardly_damped;
        best = std::move(trial);
        damping = std::max(1e-6, 0.1 * damping);
      } else {
        converged = promised < tolerance;
        damping *= 10.0;
      }
    }
    return converged;
  }

  [[nodiscard]] static LumpValues moved(const LumpValues& values, const Eigen::VectorXd& step) {
    LumpValues result{};
    for (size_t i = 0; i < lump_parameters; ++i) {
      const double longest = parameter(i).scale == SearchScale::logarithmic ? 0.5 : 8.0;
      const double change = std::clamp(step[static_cast<Index>(i)], -longest, longest);
      result[i] = std::clamp(from_coordinate(parameter(i), to_coordinate(parameter(i), values[i]) + change),
                             parameter(i).lower, parameter(i).upper);
    }
    return result;
  }

  /// A cost that is no number where the lump has no equilibrium.
  [[nodiscard]] Point evaluate(const LumpValues& values, Eigen::VectorXd shift) {
    const std::optional<LumpBody::Addition> addition = body_.addition(values);
    if (!addition) return {values, std::move(shift), Eigen::VectorXd::Constant(1, std::nan("")), {}};
    std::vector<const NodeField*> pointers{&addition->position_mm};
    for (const NodeField& field : addition->by)
      pointers.push_back(&field);
    const Index all = base_.jacobian.rows();
    Point point{values, std::move(shift), {}, {}};
    point.residuals.setZero(all + priors);
    point.jacobian.setZero(all + priors, static_cast<Index>(lump_parameters) + base_.jacobian.cols());
    point.residuals.head(all) << base_.residuals, base_.priors;
    point.residuals.head(all) += base_.jacobian * point.shift;
    point.jacobian.topRightCorner(all, base_.jacobian.cols()) = base_.jacobian;
    for (size_t slot = 0; slot < base_.pressures_kPa.size(); ++slot) {
      const Eigen::MatrixXd block = course_[slot] * rows_.columns(slot, body_.mesh(), pointers);
      point.residuals.segment(rows_.first(slot), block.rows()) += block.col(0);
      point.jacobian.block(rows_.first(slot), 0, block.rows(), lump_parameters) =
          block.rightCols<lump_parameters>();
    }
    for (Index axis = 0; axis < 3; ++axis) {
      const auto parameter = static_cast<size_t>(4 + axis);
      point.residuals[all + axis] = std::log(point.values[parameter] / usual_axis_mm) / axis_spread;
      point.jacobian(all + axis, 4 + axis) = 1.0 / axis_spread;
    }
    point.residuals[all + 3] = std::log(point.values[0]) / contrast_spread;
    point.jacobian(all + 3, 0) = 1.0 / contrast_spread;
    return point;
  }

  void finish(const Point& best, FieldFit& result) const {
    const Index rows = rows_.size();
    const auto others = static_cast<Index>(base_.choice.free.size());
    for (Index i = 0; i < others; ++i) {
      const size_t value = base_.choice.free[static_cast<size_t>(i)];
      const EffectParameter& parameter = base_.choice.parameter(value);
      double& found = result.choice.values[value];
      found = std::clamp(from_coordinate(parameter, to_coordinate(parameter, found) + best.shift[1 + i]),
                         parameter.lower, parameter.upper);
    }
    std::ranges::copy(best.values,
                      result.choice.values.begin() + static_cast<std::ptrdiff_t>(base_.choice.values.size()));
    result.C1_kPa = base_.C1_kPa * std::exp(best.shift[0]);
    for (size_t slot = 0; slot < result.pressures_kPa.size(); ++slot)
      result.pressures_kPa[slot] += best.shift[1 + others + static_cast<Index>(slot)];
    result.chi_square = best.cost();
    result.residuals = best.residuals.head(rows);
    result.priors = best.residuals.tail(best.residuals.size() - rows);
    // As in other fits: log C1, the effects' parameters, the pressures.
    result.jacobian.resize(best.jacobian.rows(), best.jacobian.cols());
    result.jacobian << best.jacobian.middleCols(lump_parameters, 1 + others),
        best.jacobian.leftCols<lump_parameters>(), best.jacobian.rightCols(best.shift.size() - 1 - others);
    result.covariance = (result.jacobian.transpose() * result.jacobian).inverse();
  }

  const FieldFit& base_;
  LumpBody body_;
  FieldRows rows_;
  std::vector<double>
      course_;  ///< what a change of stiffness moves in each frame, as a share of that at the highest pressure
  bool begun_ = false;
  bool converged_ = false;
  Point best_;
};

}  // namespace

Inclusion lump_of(const FieldFit& fit) {
  FieldModel model;
  fit.choice.apply_to(model);
  return model.inclusion.value_or(Inclusion{.semi_axes_mm = {1.0, 1.0, 1.0}});
}

FieldFit fit_lump(const FieldProblem& problem, const FieldFit& base, const Inclusion& guess,
                  LumpEffort effort) {
  LumpFit around_guess(problem, base, guess);
  constexpr double fine = 0.1;
  around_guess.descend(guess, effort == LumpEffort::once ? 1.0 : fine);
  if (effort == LumpEffort::once) return around_guess.result(guess);
  around_guess.descend(usual_lump(guess), fine);
  if (!(around_guess.result(guess).chi_square < base.chi_square)) return around_guess.result(guess);
  const Intervals intervals = around_guess.intervals(fine);
  FieldFit found = around_guess.result(guess);
  const FieldFit before = with_lump(base, guess);
  const size_t offset = base.choice.values.size();
  found.ci90.resize(found.choice.values.size());
  for (size_t i = 0; i < lump_parameters; ++i) {
    const EffectParameter& parameter = found.choice.parameter(offset + i);
    const double value = to_coordinate(parameter, found.choice.values[offset + i]);
    const double mesh_error =
        0.25 * ci90 * (value - to_coordinate(parameter, before.choice.values[offset + i]));
    for (size_t side = 0; side < 2; ++side) {
      const double half = std::hypot(intervals[i][side] - value, mesh_error);
      found.ci90[offset + i][side] = from_coordinate(parameter, side == 0 ? value - half : value + half);
    }
  }
  return found;
}

}  // namespace diastole::explain
