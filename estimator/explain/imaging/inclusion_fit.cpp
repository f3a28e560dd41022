#include "estimator/explain/imaging/inclusion_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "estimator/explain/imaging/inclusion_body.hpp"
#include "estimator/inference/covariance.hpp"
#include "estimator/inference/least_squares.hpp"
#include "estimator/mesh/node_field.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using inference::Scale;
using inference::SearchResult;

constexpr auto parameters = static_cast<Index>(inclusion_parameters);

constexpr double usual_axis_mm = 10.0;
// Weak priors, of the logarithms: few data distinguish size from contrast.
constexpr double axis_spread = 0.35;
constexpr double contrast_spread = 1.0;
constexpr Index priors = 4;
/// What the fine mesh still lacks of an inclusion's motion, beside what it changes: 0.36 to 0.46 against 39,000 unknowns.
constexpr double left_by_fine_mesh = 0.45;

/// The motion that a change of C1 makes grows faster than the pressure; so does that of an inclusion.
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
using Intervals = std::array<std::array<double, 2>, inclusion_parameters>;

InclusionValues values_of(const Inclusion& inclusion) {
  return {inclusion.contrast,        inclusion.radius_mm,       inclusion.z_mm,           inclusion.theta_deg,
          inclusion.semi_axes_mm[0], inclusion.semi_axes_mm[1], inclusion.semi_axes_mm[2]};
}

/// `base` with the guess beside it, not fitted.
FieldFit with_inclusion(const FieldFit& base, const Inclusion& guess) {
  FieldFit result = base;
  result.termination = inference::Termination::no_solution;
  const InclusionValues values = values_of(guess);
  result.choice =
      together(base.choice, {{&inclusion_effect()}, {values.begin(), values.end()}, {0, 1, 2, 3, 4, 5, 6}});
  return result;
}

/// A ball there: where a guess's contrast and axes have gone astray together, the better valley may begin here.
Inclusion usual_inclusion(const Inclusion& guess) {
  constexpr double usual_contrast = 3.0;
  Inclusion usual = guess;
  usual.contrast = guess.contrast > 1.0 ? usual_contrast : 1.0 / usual_contrast;
  usual.semi_axes_mm = {usual_axis_mm, usual_axis_mm, usual_axis_mm};
  return usual;
}

/// Of the inclusion's coordinates, then of the changes of the base fit's.
inference::ParameterSpace space_beside(const FieldFit& base) {
  std::vector<inference::Parameter> unknowns;
  for (const EffectParameter& parameter : inclusion_effect().field_parameters())
    unknowns.push_back(searched(parameter));
  unknowns.resize(unknowns.size() + static_cast<size_t>(base.jacobian.cols()), {.name = "change"});
  return inference::ParameterSpace(std::move(unknowns));
}

/// The columns of an inclusion over the rows: what it does to the residuals, and that by its parameters' coordinates.
using InclusionColumns = Eigen::Matrix<double, Eigen::Dynamic, 1 + inclusion_parameters>;

/// A body with an inclusion at one pressure, and the rows on its mesh.
class SeenInclusion {
 public:
  SeenInclusion(const FieldProblem& problem, double C1_kPa, double pressure_kPa, const Inclusion& around,
                InclusionMesh mesh)
      : body_(problem.field().base, C1_kPa, pressure_kPa, around, mesh),
        reference_(body_.mesh(), body_.mesh().reference(), problem.field().locator),
        rows_(problem.rows().relocated(reference_)) {}

  [[nodiscard]] InclusionBody& body() { return body_; }
  [[nodiscard]] const PointLocator& reference() const { return reference_; }
  [[nodiscard]] const MotionResiduals& rows() const { return rows_; }

  /// With its motion counted by a factor in each slot, the rows answering linearly; none without an equilibrium.
  [[nodiscard]] std::optional<InclusionColumns> columns(const InclusionValues& values,
                                                        const std::vector<double>& factors,
                                                        bool exact = false) {
    const std::optional<InclusionBody::Addition> addition = body_.addition(values, exact);
    if (!addition) return {};
    return rows_.columns(body_.mesh(), *addition, factors);
  }

 private:
  InclusionBody body_;
  PointLocator reference_;
  MotionResiduals rows_;
};

class InclusionFit final : public inference::LeastSquaresProblem {
 public:
  InclusionFit(const FieldProblem& problem, const FieldFit& base, const Inclusion& guess)
      : problem_(problem),
        base_(base),
        guess_(guess),
        space_(space_beside(base)),
        coarse_(problem, base.C1_kPa(), problem.nodes_kPa().back(), guess, InclusionMesh::coarse),
        course_(course_of_stiffness(base, problem.rows(), problem.nodes_kPa().back())) {}

  [[nodiscard]] const inference::ParameterSpace& space() const override { return space_; }
  [[nodiscard]] std::string failure() const override { return "the inclusion has no equilibrium there"; }
  /// Of the rows, the base fit's priors, the inclusion's priors.
  std::optional<VectorXd> residuals(const VectorXd& q) override {
    if (problem_.field().alive) problem_.field().alive();
    const std::optional<InclusionColumns> inclusion = columns(q);
    if (!inclusion) return {};
    const Index all = base_.jacobian.rows();
    VectorXd result(all + priors);
    result.head(all) = base_.all_residuals() + base_.jacobian * q.tail(base_.jacobian.cols());
    result.head(inclusion->rows()) += inclusion->col(0);
    jacobian_.setZero(all + priors, q.size());
    jacobian_.topRightCorner(all, base_.jacobian.cols()) = base_.jacobian;
    jacobian_.topLeftCorner(inclusion->rows(), parameters) = inclusion->rightCols<inclusion_parameters>();
    for (Index axis = 0; axis < 3; ++axis) {
      result[all + axis] = (q[4 + axis] - std::log(usual_axis_mm)) / axis_spread;
      jacobian_(all + axis, 4 + axis) = 1.0 / axis_spread;
    }
    result[all + 3] = q[0] / contrast_spread;
    jacobian_(all + 3, 0) = 1.0 / contrast_spread;
    return result;
  }
  Eigen::MatrixXd jacobian(const VectorXd&) override { return jacobian_; }

  /// Downhill from an inclusion, until a step gains less than `tolerance` of chi2; the best one so far is kept.
  void descend(const Inclusion& from, double tolerance) {
    VectorXd start = VectorXd::Zero(space_.size());
    const InclusionValues values = values_of(from);
    for (Index i = 0; i < parameters; ++i)
      start[i] = space_[i].coordinate(values[static_cast<size_t>(i)]);
    SearchResult found = search(start, tolerance);
    if (found.termination == inference::Termination::no_solution) return;
    if (!best_ || found.cost() < best_->cost()) best_ = std::move(found);
  }

  /// Corrects what an inclusion does by what a fine mesh, equilibria at all nodes' pressures and tags followed through the
  /// whole motion say about the best one and its slopes, and goes on downhill. Nothing changes if one of them was not found.
  /// Precondition: `descend` has found an inclusion.
  void refine(double tolerance) {
    const InclusionValues values = values_at(best_->q);
    SeenInclusion fine(problem_, base_.C1_kPa(), problem_.nodes_kPa().back(),
                       inclusion_with(values, problem_.field().base), InclusionMesh::fine);
    const auto coarse = coarse_.columns(values, course_, true);
    const auto finer = fine.columns(values, course_, true);
    const auto followed = coarse && finer ? followed_columns(values) : std::nullopt;
    if (!followed) return;
    correction_ = (*finer - *coarse) + (*followed - *coarse);
    corrected_at_ = best_->q.head<parameters>();
    SearchResult corrected = search(best_->q, tolerance);
    if (corrected.termination == inference::Termination::no_solution) {
      correction_.resize(0, Eigen::NoChange);
      return;
    }
    mesh_error_ = left_by_fine_mesh * (*finer - *coarse).col(0).norm();
    best_ = std::move(corrected);
  }

  /// The meshes' part in a parameter's error, beside that of the tags: their error spread over the inclusion's parameters.
  [[nodiscard]] double mesh_share() const {
    return mesh_error_ / std::sqrt(static_cast<double>(inclusion_parameters));
  }

  /// The best inclusion so far; the guess, without a solution, if there is none.
  [[nodiscard]] FieldFit result() const {
    FieldFit result = with_inclusion(base_, guess_);
    if (!best_) return result;
    const VectorXd shift = best_->q.tail(base_.jacobian.cols());
    const auto others = static_cast<Index>(base_.choice.free.size());
    for (Index i = 0; i < others; ++i) {
      const size_t value = base_.choice.free[static_cast<size_t>(i)];
      const inference::Parameter parameter = searched(base_.choice.parameter(value));
      double& found = result.choice.values[value];
      found = std::clamp(parameter.value(parameter.coordinate(found) + shift[1 + i]), parameter.lower,
                         parameter.upper);
    }
    std::ranges::copy(values_at(best_->q),
                      result.choice.values.begin() + static_cast<std::ptrdiff_t>(base_.choice.values.size()));
    result.law = {base_.C1_kPa() * std::exp(shift[0])};
    for (size_t slot = 0; slot < result.pressures_kPa.size(); ++slot)
      result.pressures_kPa[slot] += shift[1 + others + static_cast<Index>(slot)];
    const Index rows = problem_.rows().size();
    result.termination = best_->termination;
    result.chi_square = best_->residuals.squaredNorm();
    result.residuals = best_->residuals.head(rows);
    result.priors = best_->residuals.tail(best_->residuals.size() - rows);
    // As in other fits: log C1, the effects' parameters, the pressures.
    const Eigen::MatrixXd& jacobian = best_->jacobian;
    result.jacobian.resize(jacobian.rows(), jacobian.cols());
    result.jacobian << jacobian.middleCols(parameters, 1 + others), jacobian.leftCols<parameters>(),
        jacobian.rightCols(shift.size() - 1 - others);
    result.covariance = inference::estimate_covariance(result.jacobian).matrix;
    return result;
  }

  /// 90 % intervals of the parameters' coordinates. Contrast, size and depth trade off against one another, not always
  /// within one valley: the others are refitted at held contrasts on both sides, until that costs 2.7 of chi2, and every
  /// parameter's interval is what all these fits leave open. A held fit in a deeper valley than the best one's replaces it,
  /// and the profile begins again there. Precondition: `descend` has found an inclusion.
  [[nodiscard]] Intervals intervals(double tolerance) {
    constexpr int valleys = 4;
    for (int valley = 1; valley < valleys; ++valley) {
      const Profile profile = profile_of_contrast(tolerance);
      if (!profile.deeper) return profile.intervals;
      SearchResult found = search(profile.deeper->q, tolerance);
      best_ = found.residuals.size() > 0 ? std::move(found) : *profile.deeper;
    }
    return profile_of_contrast(std::numeric_limits<double>::infinity()).intervals;
  }

 private:
  struct Profile {
    Intervals intervals{};
    std::optional<SearchResult> deeper;  // where it ended, if there
  };

  static constexpr double allowed = 2.706;  // of chi2: 90 % of one parameter

  /// From a point on; without a solution if that has no equilibrium.
  [[nodiscard]] SearchResult search(const VectorXd& from, double tolerance, bool hold_contrast = false) {
    constexpr double longest_factor = 0.5;  // of a logarithm
    constexpr double longest_mm = 8.0;      // or degrees
    inference::SearchOptions options{.iteration_limit = 20, .first_radius = 1e3};
    options.small_gain = [tolerance](double) { return tolerance; };
    if (hold_contrast) options.held = free_but_contrast(true);
    options.longest_step = VectorXd::Constant(space_.size(), HUGE_VAL);
    for (Index i = 0; i < parameters; ++i)
      options.longest_step[i] = space_[i].scale == Scale::logarithmic ? longest_factor : longest_mm;
    return inference::minimise(*this, from, options);
  }

  [[nodiscard]] std::vector<bool> free_but_contrast(bool contrast) const {
    std::vector<bool> flags(static_cast<size_t>(space_.size()), !contrast);
    flags.front() = contrast;
    return flags;
  }

  [[nodiscard]] InclusionValues values_at(const VectorXd& q) const {
    InclusionValues values{};
    for (Index i = 0; i < parameters; ++i)
      values[static_cast<size_t>(i)] = space_[i].value(q[i]);
    return values;
  }

  /// Ends at a fit that is better than the best one by more than `gain`.
  [[nodiscard]] Profile profile_of_contrast(double gain) {
    Profile profile{open_at(*best_, 0.0), {}};
    Intervals& found = profile.intervals;
    const double best_chi_square = best_->residuals.squaredNorm();
    const double variance = inference::estimate_covariance(best_->jacobian).matrix(0, 0);
    const double usual = std::clamp(std::sqrt(variance), 0.08, 0.6);
    for (const double direction : {-1.0, 1.0}) {
      VectorXd q = best_->q;
      double cost_before = 0.0;
      VectorXd before = q;
      for (double away = usual; away < 6.0 * usual; away *= 1.6) {
        q[0] = std::clamp(best_->q[0] + direction * away, space_.lower()[0], space_.upper()[0]);
        SearchResult at = search(q, 0.2, true);
        if (at.termination == inference::Termination::no_solution) break;
        q = at.q;
        const double risen = at.residuals.squaredNorm() - best_chi_square;
        if (risen < -gain) {
          profile.deeper = std::move(at);
          return profile;
        }
        const double cost = std::max(0.0, risen);
        if (cost >= allowed) {
          const double part =
              (std::sqrt(allowed) - std::sqrt(cost_before)) / (std::sqrt(cost) - std::sqrt(cost_before));
          for (size_t i = 0; i < inclusion_parameters; ++i) {
            const auto k = static_cast<Index>(i);
            const double crossing = std::lerp(before[k], q[k], part);
            widen(found[i], {crossing, crossing});
          }
          break;
        }
        widen(found, open_at(at, cost));
        widen(found[0], {q[0], q[0]});
        before = q;
        cost_before = cost;
        if (q[0] == space_.lower()[0] || q[0] == space_.upper()[0]) break;
      }
    }
    return profile;
  }
  /// What a point of the profile leaves open for each parameter, all others but the contrast free, when it costs so much
  /// already.
  [[nodiscard]] Intervals open_at(const SearchResult& at, double cost) const {
    const Eigen::MatrixXd covariance =
        inference::estimate_covariance(at.jacobian, free_but_contrast(false)).matrix;
    Intervals result{};
    for (size_t i = 0; i < inclusion_parameters; ++i) {
      const auto k = static_cast<Index>(i);
      const double half = std::sqrt((allowed - cost) * covariance(k, k));
      result[i] = {at.q[k] - half, at.q[k] + half};
    }
    return result;
  }
  /// On the coarse mesh: the change of the tags' own errors between the body without and with the inclusion, at the frames'
  /// pressures (FieldProblem::shares).
  [[nodiscard]] std::optional<InclusionColumns> followed_columns(const InclusionValues& values) {
    const HermiteMesh& mesh = coarse_.body().mesh();
    const size_t slots = base_.pressures_kPa.size();
    InclusionBody::Addition nothing;
    nothing.fill(NodeField(mesh.reference().size(), 0.0));
    std::vector<NodeField> plain_mm(slots, mesh.reference());
    std::vector<InclusionBody::Addition> added(slots, nothing);
    for (size_t node = 0; node < problem_.nodes_kPa().size(); ++node) {
      std::optional<InclusionBody> other;
      if (node != problem_.highest_node())
        other.emplace(problem_.field().base, base_.C1_kPa(), problem_.nodes_kPa()[node], guess_,
                      InclusionMesh::coarse);
      InclusionBody& body = other ? *other : coarse_.body();
      const std::optional<InclusionBody::Addition> addition = body.addition(values, true);
      if (!addition) return {};
      const NodeField motion_mm = difference(*body.plain_mm(), mesh.reference());
      for (size_t slot = 0; slot < slots; ++slot) {
        const double share = problem_.shares(base_.pressures_kPa[slot])[node];
        add_scaled(plain_mm[slot], share, motion_mm);
        for (size_t k = 0; k < nothing.size(); ++k)
          add_scaled(added[slot][k], share, (*addition)[k]);
      }
    }
    MotionResiduals rows = coarse_.rows();
    InclusionColumns result(rows.size(), 1 + parameters);
    if (!rows.follow(mesh, coarse_.reference(), plain_mm, Following::closely)) return {};
    const VectorXd plain = rows.residuals();
    for (size_t slot = 0; slot < slots; ++slot)
      add_scaled(plain_mm[slot], 1.0, added[slot].front());
    if (!rows.follow(mesh, coarse_.reference(), plain_mm, Following::closely)) return {};
    for (size_t slot = 0; slot < slots; ++slot)
      result.middleRows(rows.first(slot), rows.count(slot)) =
          rows.columns(slot, mesh, pointers_to(added[slot]));
    result.col(0) = rows.residuals() - plain;
    return result;
  }
  /// Beyond a usual change of the inclusion the correction stays what it was.
  [[nodiscard]] std::optional<InclusionColumns> columns(const VectorXd& q) {
    std::optional<InclusionColumns> result = coarse_.columns(values_at(q), course_);
    if (!result || correction_.size() == 0) return result;
    result->col(0) += correction_.col(0);
    for (Index i = 0; i < parameters; ++i) {
      const double most = space_[i].scale == Scale::logarithmic ? 0.4 : 3.0;
      const double away = q[i] - corrected_at_[i];
      result->col(0) += std::clamp(away, -most, most) * correction_.col(1 + i);
      if (std::abs(away) < most) result->col(1 + i) += correction_.col(1 + i);
    }
    return result;
  }

  static void widen(std::array<double, 2>& interval, const std::array<double, 2>& by) {
    interval = {std::min(interval[0], by[0]), std::max(interval[1], by[1])};
  }
  static void widen(Intervals& intervals, const Intervals& by) {
    for (size_t i = 0; i < inclusion_parameters; ++i)
      widen(intervals[i], by[i]);
  }

  const FieldProblem& problem_;
  const FieldFit& base_;
  Inclusion guess_;
  inference::ParameterSpace space_;
  SeenInclusion coarse_;         // at the highest pressure
  double mesh_error_ = 0.0;      // of all rows, in sigmas
  InclusionColumns correction_;  // of what coarse_ says, at corrected_at_ and by the parameters there
  Eigen::Vector<double, parameters> corrected_at_;
  std::vector<double>
      course_;  ///< what a change of stiffness moves in each frame, as a share of that at the highest pressure
  Eigen::MatrixXd jacobian_;  ///< where `residuals` was last found
  std::optional<SearchResult> best_;
};

}  // namespace

Inclusion inclusion_of(const FieldFit& fit) {
  FieldModel model;
  fit.choice.apply_to(model);
  return model.inclusion.value_or(Inclusion{.semi_axes_mm = {1.0, 1.0, 1.0}});
}

FieldFit fit_inclusion(const FieldProblem& problem, const FieldFit& base, const Inclusion& guess,
                       InclusionEffort effort) {
  InclusionFit around_guess(problem, base, guess);
  constexpr double fine = 0.1;
  around_guess.descend(guess, effort == InclusionEffort::once ? 1.0 : fine);
  if (effort == InclusionEffort::once) return around_guess.result();
  around_guess.descend(usual_inclusion(guess), fine);
  if (!(around_guess.result().chi_square < base.chi_square)) return around_guess.result();
  around_guess.refine(fine);
  const Intervals intervals = around_guess.intervals(fine);
  const double widened = std::hypot(1.0, around_guess.mesh_share());
  FieldFit found = around_guess.result();
  const size_t offset = base.choice.values.size();
  found.ci90.resize(found.choice.values.size());
  for (size_t i = 0; i < inclusion_parameters; ++i) {
    const inference::Parameter parameter = searched(found.choice.parameter(offset + i));
    const double value = parameter.coordinate(found.choice.values[offset + i]);
    for (size_t side = 0; side < 2; ++side)
      found.ci90[offset + i][side] = parameter.value(value + widened * (intervals[i][side] - value));
  }
  return found;
}

}  // namespace diastole::explain
