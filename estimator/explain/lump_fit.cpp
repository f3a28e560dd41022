#include "estimator/explain/lump_fit.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "estimator/fe/elastic_system.hpp"
#include "estimator/mesh/annulus_grid.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;

constexpr size_t lump_parameters = 7;
constexpr double usual_axis_mm = 10.0;
constexpr double axis_spread =
    0.35;  // of the semi-axes' logarithms, a weak prior: few data tell size from contrast

/// Levels at both ends and around a centre, gaps of more than 20 mm halved.
std::vector<double> levels_around(double low_mm, double high_mm, double centre_mm) {
  constexpr double lump_mm = 11.0;
  constexpr double plate_mm = 7.0;
  constexpr double gap_mm = 20.0;
  constexpr double too_close_mm = 5.0;
  std::vector<double> wanted{low_mm, high_mm, low_mm + plate_mm, high_mm - plate_mm};
  for (const double level_mm : {centre_mm, centre_mm - lump_mm, centre_mm + lump_mm}) {
    const bool apart =
        std::ranges::all_of(wanted, [&](double other) { return std::abs(other - level_mm) > too_close_mm; });
    if (level_mm > low_mm && level_mm < high_mm && apart) wanted.push_back(level_mm);
  }
  std::ranges::sort(wanted);
  std::vector<double> levels{wanted.front()};
  for (size_t i = 1; i < wanted.size(); ++i) {
    if (wanted[i] - wanted[i - 1] > gap_mm) levels.push_back(0.5 * (wanted[i] + wanted[i - 1]));
    levels.push_back(wanted[i]);
  }
  return levels;
}

HermiteMesh mesh_around(const FieldModel& body, const Inclusion& lump) {
  AnnulusGrid grid;
  for (const double offset_deg : {-115.0, -70.0, -36.0, -16.0, 0.0, 16.0, 36.0, 70.0, 115.0, 180.0})
    grid.angles_deg.push_back(lump.theta_deg + offset_deg);
  grid.heights_mm = levels_around(-0.5 * body.height_mm, 0.5 * body.height_mm, lump.z_mm);
  const double wall_mm = body.outer_radius_mm - body.inner_radius_mm;
  grid.radii_mm = {
      body.inner_radius_mm,
      std::clamp(lump.radius_mm, body.inner_radius_mm + 0.35 * wall_mm, body.outer_radius_mm - 0.4 * wall_mm),
      body.outer_radius_mm};
  return make_annulus(grid);
}

class LumpFit {
 public:
  LumpFit(const FieldProblem& problem, const FieldFit& base, const Inclusion& guess)
      : effect_(*find_effect("stiff-inclusion")),
        base_(base),
        body_(problem.field().base),
        mesh_(mesh_around(body_, guess)),
        rows_(problem.rows().relocated(PointLocator(mesh_, mesh_.reference(), problem.field().locator))),
        highest_kPa_(problem.nodes_kPa().back()) {
    const std::unique_ptr<ElasticModel> plain = build({});
    Solution solution = plain->solve(highest_kPa_);
    solved_ = solution.report.converged();
    state_ = std::move(solution.state);
  }

  FieldFit run(const Inclusion& guess) {
    FieldFit result = base_;
    result.converged = false;
    result.choice = {&effect_,
                     {guess.contrast, guess.radius_mm, guess.z_mm, guess.theta_deg, guess.semi_axes_mm[0],
                      guess.semi_axes_mm[1], guess.semi_axes_mm[2]},
                     {0, 1, 2, 3, 4, 5, 6},
                     axis_spread};
    if (!solved_) return result;
    Point best = evaluate(result.choice.values, Eigen::VectorXd::Zero(base_.jacobian.cols()));
    double damping = 1e-3;
    for (int iteration = 0; iteration < 14 && !result.converged; ++iteration) {
      Eigen::MatrixXd normal = best.jacobian.transpose() * best.jacobian;
      const Eigen::VectorXd gradient = best.jacobian.transpose() * best.residuals;
      normal.diagonal() *= 1.0 + damping;
      const Eigen::VectorXd step = -normal.ldlt().solve(gradient);
      Point trial = evaluate(moved(best.values, step.head<lump_parameters>()),
                             best.shift + step.tail(best.shift.size()));
      if (trial.cost() < best.cost()) {
        result.converged = best.cost() - trial.cost() < 0.1;
        best = std::move(trial);
        damping = std::max(1e-6, 0.1 * damping);
      } else {
        result.converged = -gradient.dot(step) < 0.1;
        damping *= 10.0;
      }
    }
    finish(best, result);
    return result;
  }

 private:
  struct Point {
    std::vector<double> values;
    Eigen::VectorXd shift;      // of log C1 and the pressures, from the base fit
    Eigen::VectorXd residuals;  // rows, the base fit's priors, the axes' priors
    Eigen::MatrixXd jacobian;   // lump parameters, then shift
    [[nodiscard]] double cost() const { return residuals.squaredNorm(); }
  };

  [[nodiscard]] std::unique_ptr<ElasticModel> build(const StiffnessField& stiffness) const {
    ElasticOptions options;
    options.parameters = {base_.C1_kPa};
    options.stiffness = stiffness;
    return std::make_unique<ElasticModel>(mesh_, *find_law("neo-hookean"), std::move(options));
  }

  [[nodiscard]] StiffnessField stiffness_of(const std::vector<double>& values) const {
    FieldModel model = body_;
    effect_.apply_to_field(values, model);
    return [lump = model.inclusion.value_or(Inclusion{.semi_axes_mm = {1.0, 1.0, 1.0}})](
               const Eigen::Vector3d& X_mm) {
      return lump.stiffness({X_mm[0], X_mm[1], X_mm[2]});
    };
  }

  [[nodiscard]] std::vector<double> moved(const std::vector<double>& values,
                                          const Eigen::VectorXd& step) const {
    std::vector<double> result;
    for (size_t i = 0; i < lump_parameters; ++i) {
      const EffectParameter& parameter = effect_.field_parameters()[i];
      const double longest = parameter.scale == SearchScale::logarithmic ? 0.5 : 8.0;
      const double change = std::clamp(step[static_cast<Index>(i)], -longest, longest);
      result.push_back(std::clamp(from_coordinate(parameter, to_coordinate(parameter, values[i]) + change),
                                  parameter.lower, parameter.upper));
    }
    return result;
  }

  /// What the lump adds to the motion at the highest pressure, and its derivatives by the parameters' coordinates.
  [[nodiscard]] std::vector<NodeField> additions(const std::vector<double>& values) const {
    const std::unique_ptr<ElasticModel> model = build(stiffness_of(values));
    ElasticSystem& system = model->system();
    ElasticState at = state_;
    system.factorise(at);
    for (int correction = 0; correction < 2; ++correction) {
      std::vector<double> step = system.residual(at).values;
      system.solve(step);
      at = system.moved(at, step, -1.0);
    }
    std::vector<NodeField> fields{at.position_mm};
    for (size_t dof = 0; dof < fields[0].size(); ++dof)
      fields[0][dof] -= state_.position_mm[dof];
    std::vector<double> sides;
    for (size_t i = 0; i < lump_parameters; ++i) {
      const EffectParameter& parameter = effect_.field_parameters()[i];
      const double h = parameter.scale == SearchScale::logarithmic ? 1e-3 : 1e-2;
      std::vector<double> up = values;
      std::vector<double> down = values;
      up[i] = from_coordinate(parameter, to_coordinate(parameter, values[i]) + h);
      down[i] = from_coordinate(parameter, to_coordinate(parameter, values[i]) - h);
      const std::vector<double> above = build(stiffness_of(up))->system().residual(at).values;
      const std::vector<double> below = build(stiffness_of(down))->system().residual(at).values;
      for (size_t k = 0; k < above.size(); ++k)
        sides.push_back((below[k] - above[k]) / (2.0 * h));
    }
    system.solve(sides, lump_parameters);
    for (size_t i = 0; i < lump_parameters; ++i)
      fields.push_back(system.node_field(std::span(sides).subspan(i * model->dofs(), model->dofs())));
    return fields;
  }

  [[nodiscard]] Point evaluate(std::vector<double> values, Eigen::VectorXd shift) const {
    const std::vector<NodeField> fields = additions(values);
    std::vector<const NodeField*> pointers;
    for (const NodeField& field : fields)
      pointers.push_back(&field);
    const Index all = base_.jacobian.rows();
    Point point{std::move(values), std::move(shift), {}, {}};
    point.residuals.setZero(all + 3);
    point.jacobian.setZero(all + 3, static_cast<Index>(lump_parameters) + base_.jacobian.cols());
    point.residuals.head(all) << base_.residuals, base_.priors;
    point.residuals.head(all) += base_.jacobian * point.shift;
    point.jacobian.topRightCorner(all, base_.jacobian.cols()) = base_.jacobian;
    for (size_t slot = 0; slot < base_.pressures_kPa.size(); ++slot) {
      const Eigen::MatrixXd block =
          base_.pressures_kPa[slot] / highest_kPa_ * rows_.columns(slot, mesh_, pointers);
      point.residuals.segment(rows_.first(slot), block.rows()) += block.col(0);
      point.jacobian.block(rows_.first(slot), 0, block.rows(), lump_parameters) =
          block.rightCols<lump_parameters>();
    }
    for (Index axis = 0; axis < 3; ++axis) {
      const auto parameter = static_cast<size_t>(4 + axis);
      point.residuals[all + axis] = std::log(point.values[parameter] / usual_axis_mm) / axis_spread;
      point.jacobian(all + axis, 4 + axis) = 1.0 / axis_spread;
    }
    return point;
  }

  void finish(const Point& best, FieldFit& result) const {
    const Index rows = rows_.size();
    result.choice.values = best.values;
    result.C1_kPa = base_.C1_kPa * std::exp(best.shift[0]);
    for (size_t slot = 0; slot < result.pressures_kPa.size(); ++slot)
      result.pressures_kPa[slot] += best.shift[1 + static_cast<Index>(slot)];
    result.chi_square = best.cost();
    result.residuals = best.residuals.head(rows);
    result.priors = best.residuals.tail(best.residuals.size() - rows);
    // As in other fits: log C1, the effect's parameters, the pressures.
    result.jacobian.resize(best.jacobian.rows(), best.jacobian.cols());
    result.jacobian << best.jacobian.col(lump_parameters), best.jacobian.leftCols<lump_parameters>(),
        best.jacobian.rightCols(best.shift.size() - 1);
    result.covariance = (result.jacobian.transpose() * result.jacobian).inverse();
  }

  const Effect& effect_;
  const FieldFit& base_;
  FieldModel body_;
  HermiteMesh mesh_;
  FieldRows rows_;
  double highest_kPa_;
  ElasticState state_;
  bool solved_ = false;
};

}  // namespace

FieldFit fit_lump(const FieldProblem& problem, const FieldFit& base, const Inclusion& guess) {
  return LumpFit(problem, base, guess).run(guess);
}

}  // namespace diastole::explain
