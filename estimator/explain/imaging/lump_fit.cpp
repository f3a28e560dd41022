#include "estimator/explain/imaging/lump_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "estimator/explain/imaging/lump_body.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;

constexpr double usual_axis_mm = 10.0;
// Weak priors, of the logarithms: few data tell size from contrast.
constexpr double axis_spread = 0.35;
constexpr double contrast_spread = 1.0;
constexpr Index priors = 4;
/// What the fine mesh still lacks of a lump's motion, beside what it changes: 0.36 to 0.46 against 39,000 unknowns.
constexpr double left_by_fine_mesh = 0.45;

/// The motion that a change of C1 makes grows faster than the pressure; so does that of a lump.
std::vector<double> course_of_stiffness(const FieldFit& base, const MotionResiduals& rows,
                                        double highest_kPa) {
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
      together(base.choice, {{&inclusion_effect()},
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

/// The columns of a lump over the rows: what it does to the residuals, and that by its parameters' coordinates.
using LumpColumns = Eigen::Matrix<double, Eigen::Dynamic, 1 + lump_parameters>;

LumpValues values_of(const Inclusion& lump) {
  return {lump.contrast,        lump.radius_mm,       lump.z_mm,           lump.theta_deg,
          lump.semi_axes_mm[0], lump.semi_axes_mm[1], lump.semi_axes_mm[2]};
}

/// A body with a lump at one pressure, and the rows on its mesh.
class SeenLump {
 public:
  SeenLump(const FieldProblem& problem, double C1_kPa, double pressure_kPa, const Inclusion& around,
           LumpMesh mesh)
      : body_(problem.field().base, C1_kPa, pressure_kPa, around, mesh),
        reference_(body_.mesh(), body_.mesh().reference(), problem.field().locator),
        rows_(problem.rows().relocated(reference_)) {}

  [[nodiscard]] LumpBody& body() { return body_; }
  [[nodiscard]] const PointLocator& reference() const { return reference_; }
  [[nodiscard]] const MotionResiduals& rows() const { return rows_; }

  /// With its motion counted by a factor in each slot, the rows answering linearly; none without an equilibrium.
  [[nodiscard]] std::optional<LumpColumns> columns(const LumpValues& values,
                                                   const std::vector<double>& factors, bool exact = false) {
    const std::optional<LumpBody::Addition> addition = body_.addition(values, exact);
    if (!addition) return {};
    std::vector<const NodeField*> pointers{&addition->position_mm};
    for (const NodeField& field : addition->by)
      pointers.push_back(&field);
    LumpColumns result(rows_.size(), 1 + lump_parameters);
    for (size_t slot = 0; slot < factors.size(); ++slot)
      result.middleRows(rows_.first(slot), rows_.count(slot)) =
          factors[slot] * rows_.columns(slot, body_.mesh(), pointers);
    return result;
  }

 private:
  LumpBody body_;
  PointLocator reference_;
  MotionResiduals rows_;
};

class LumpFit {
 public:
  LumpFit(const FieldProblem& problem, const FieldFit& base, const Inclusion& guess)
      : problem_(problem),
        base_(base),
        guess_(guess),
        coarse_(problem, base.C1_kPa, problem.nodes_kPa().back(), guess, LumpMesh::coarse),
        course_(course_of_stiffness(base, problem.rows(), problem.nodes_kPa().back())) {}

  /// Downhill from a lump, until a step gains less than `tolerance` of chi2; the best one so far is kept.
  void descend(const Inclusion& from, double tolerance) {
    Point at = evaluate(values_of(from), Eigen::VectorXd::Zero(base_.jacobian.cols()));
    if (!at.found()) return;
    const bool converged = minimise(at, false, tolerance);
    if (begun_ && at.cost() >= best_.cost()) return;
    best_ = std::move(at);
    converged_ = converged;
    begun_ = true;
  }

  /// Corrects what a lump does by what a fine mesh, equilibria at all nodes' pressures and tags followed through the whole
  /// motion say about the best one and its slopes, and goes on downhill. Nothing changes if one of them was not found.
  /// Precondition: `descend` has found a lump.
  void refine(double tolerance) {
    const Inclusion around = lump_with(best_.values, problem_.field().base);
    SeenLump fine(problem_, base_.C1_kPa, problem_.nodes_kPa().back(), around, LumpMesh::fine);
    const auto coarse = coarse_.columns(best_.values, course_, true);
    const auto finer = fine.columns(best_.values, course_, true);
    const auto followed = coarse && finer ? followed_columns() : std::nullopt;
    if (!followed) return;
    correction_ = (*finer - *coarse) + (*followed - *coarse);
    mesh_error_ = left_by_fine_mesh * (*finer - *coarse).col(0).norm();
    corrected_at_ = best_.values;
    Point corrected = evaluate(best_.values, best_.shift);
    if (!corrected.found()) {
      correction_.resize(0, Eigen::NoChange);
      return;
    }
    best_ = std::move(corrected);
    converged_ = minimise(best_, false, tolerance);
  }

  /// The meshes' part in a parameter's error, beside that of the tags: their error spread over the lump's parameters.
  [[nodiscard]] double mesh_share() const {
    return mesh_error_ / std::sqrt(static_cast<double>(lump_parameters));
  }

  /// The best lump so far; the guess, not converged, if there is none.
  [[nodiscard]] FieldFit result() const {
    FieldFit found = with_lump(base_, guess_);
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
    [[nodiscard]] bool found() const { return std::isfinite(cost()); }  // an equilibrium
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
        if (!at.found()) break;
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
    return inclusion_effect().field_parameters()[i];
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

  /// Levenberg-Marquardt from a point that is found. Whether it converged.
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
        damping = std::max(hardly_damped, 10.0 * damping);
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

  /// Of the best lump on the coarse mesh: the change of the tags' own errors between the body without and with it, at the
  /// frames' pressures (FieldProblem::shares).
  [[nodiscard]] std::optional<LumpColumns> followed_columns() {
    const HermiteMesh& mesh = coarse_.body().mesh();
    const size_t slots = base_.pressures_kPa.size();
    std::vector<NodeField> plain_mm(slots, mesh.reference());
    std::vector<NodeField> lumped_mm = plain_mm;
    std::vector<std::array<NodeField, lump_parameters>> by(slots);
    for (auto& fields : by)
      fields.fill(NodeField(mesh.reference().size(), 0.0));
    for (size_t node = 0; node < problem_.nodes_kPa().size(); ++node) {
      std::optional<LumpBody> other;
      if (node != problem_.highest_node())
        other.emplace(problem_.field().base, base_.C1_kPa, problem_.nodes_kPa()[node], guess_,
                      LumpMesh::coarse);
      LumpBody& body = other ? *other : coarse_.body();
      const std::optional<LumpBody::Addition> addition = body.addition(best_.values, true);
      if (!addition) return {};
      for (size_t slot = 0; slot < slots; ++slot) {
        const double share = problem_.shares(base_.pressures_kPa[slot])[node];
        for (size_t dof = 0; dof < mesh.reference().size(); ++dof) {
          const double motion_mm = (*body.plain_mm())[dof] - mesh.reference()[dof];
          plain_mm[slot][dof] += share * motion_mm;
          lumped_mm[slot][dof] += share * (motion_mm + addition->position_mm[dof]);
          for (size_t i = 0; i < lump_parameters; ++i)
            by[slot][i][dof] += share * addition->by[i][dof];
        }
      }
    }
    MotionResiduals rows = coarse_.rows();
    LumpColumns result(rows.size(), 1 + lump_parameters);
    if (!rows.follow(mesh, coarse_.reference(), plain_mm, Following::closely)) return {};
    result.col(0) = -rows.residuals();
    if (!rows.follow(mesh, coarse_.reference(), lumped_mm, Following::closely)) return {};
    result.col(0) += rows.residuals();
    for (size_t slot = 0; slot < slots; ++slot) {
      std::vector<const NodeField*> pointers;
      for (const NodeField& field : by[slot])
        pointers.push_back(&field);
      result.middleRows(rows.first(slot), rows.count(slot)).rightCols<lump_parameters>() =
          rows.columns(slot, mesh, pointers);
    }
    return result;
  }

  /// Beyond a usual change of the lump the correction stays what it was.
  [[nodiscard]] std::optional<LumpColumns> columns(const LumpValues& values) {
    std::optional<LumpColumns> result = coarse_.columns(values, course_);
    if (!result || correction_.size() == 0) return result;
    result->col(0) += correction_.col(0);
    for (size_t i = 0; i < lump_parameters; ++i) {
      const double most = parameter(i).scale == SearchScale::logarithmic ? 0.4 : 3.0;
      const double away =
          to_coordinate(parameter(i), values[i]) - to_coordinate(parameter(i), corrected_at_[i]);
      const auto column = static_cast<Index>(1 + i);
      result->col(0) += std::clamp(away, -most, most) * correction_.col(column);
      if (std::abs(away) < most) result->col(column) += correction_.col(column);
    }
    return result;
  }

  /// A cost that is no number where the lump has no equilibrium.
  [[nodiscard]] Point evaluate(const LumpValues& values, Eigen::VectorXd shift) {
    if (problem_.field().alive) problem_.field().alive();
    const std::optional<LumpColumns> lump = columns(values);
    if (!lump) return {values, std::move(shift), Eigen::VectorXd::Constant(1, std::nan("")), {}};
    const Index all = base_.jacobian.rows();
    Point point{values, std::move(shift), {}, {}};
    point.residuals.setZero(all + priors);
    point.jacobian.setZero(all + priors, static_cast<Index>(lump_parameters) + base_.jacobian.cols());
    point.residuals.head(all) << base_.residuals, base_.priors;
    point.residuals.head(all) += base_.jacobian * point.shift;
    point.jacobian.topRightCorner(all, base_.jacobian.cols()) = base_.jacobian;
    point.residuals.head(lump->rows()) += lump->col(0);
    point.jacobian.topLeftCorner(lump->rows(), lump_parameters) = lump->rightCols<lump_parameters>();
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
    const Index rows = problem_.rows().size();
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

  const FieldProblem& problem_;
  const FieldFit& base_;
  Inclusion guess_;
  SeenLump coarse_;          // at the highest pressure
  double mesh_error_ = 0.0;  // of all rows, in sigmas
  LumpColumns correction_;   // of what coarse_ says, at corrected_at_ and by the parameters there
  LumpValues corrected_at_{};
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
  if (effort == LumpEffort::once) return around_guess.result();
  around_guess.descend(usual_lump(guess), fine);
  if (!(around_guess.result().chi_square < base.chi_square)) return around_guess.result();
  around_guess.refine(fine);
  const Intervals intervals = around_guess.intervals(fine);
  const double widened = std::hypot(1.0, around_guess.mesh_share());
  FieldFit found = around_guess.result();
  const size_t offset = base.choice.values.size();
  found.ci90.resize(found.choice.values.size());
  for (size_t i = 0; i < lump_parameters; ++i) {
    const EffectParameter& parameter = found.choice.parameter(offset + i);
    const double value = to_coordinate(parameter, found.choice.values[offset + i]);
    for (size_t side = 0; side < 2; ++side)
      found.ci90[offset + i][side] =
          from_coordinate(parameter, value + widened * (intervals[i][side] - value));
  }
  return found;
}

}  // namespace diastole::explain
