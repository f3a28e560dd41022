#include "estimator/reconstruction/frame_field.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "estimator/motion_residuals/tag_match.hpp"
#include "estimator/parallel/parallel_for.hpp"
#include "protocol/signal/median.hpp"

namespace diastole {
namespace {

constexpr double first_lambda = 1e3;
constexpr int most_rounds = 24;
constexpr int tukey_round = 1, validation_round = 2, last_validation_round = 3;
constexpr double huber_bend = 1.345, tukey_reach = 4.685;
constexpr double reject_sigma = 5.0;  // in units of the residuals' own spread, or of sigma if that is more
/// A direction sees a third of a motion's square: no body moves much farther, RMS, than root three times what its points see. (Nor less
/// than a pixel.) Without that limit a turn out of the tags' sight takes the place of a stretch, which it foreshortens to.
constexpr double unseen_to_seen = 2.0, least_extent_mm = 1.0;
constexpr int most_halvings = 10;
constexpr double least_scale = 1.0;  // nothing is wild within its own sigmas, however good the others are

double huber_weight(double residual) {
  return std::min(1.0, huber_bend / std::max(std::abs(residual), 1e-12));
}

double tukey_weight(double residual) {
  const double inside = 1.0 - residual * residual / (tukey_reach * tukey_reach);
  return inside > 0.0 ? inside * inside : 0.0;
}

/// One frame's data, looked up on the moving body again and again.
class FrameData {
 public:
  FrameData(const HermiteMesh& mesh, const Measurement& measurement, int frame, const LocatorOptions& options)
      : mesh_(mesh),
        measurement_(measurement),
        options_(options),
        reference_(mesh, mesh.reference(), options) {
    for (size_t i = 0; i < measurement.tags.size(); ++i) {
      if (measurement.tags[i].frame == frame) tags_.push_back(i);
    }
    for (size_t i = 0; i < measurement.points.size(); ++i) {
      if (measurement.points[i].frame != frame) continue;
      if (const auto found = reference_.find(vector_of(measurement.points[i].X_mm))) {
        points_.emplace_back(i, found->point);
      } else {
        points_not_found_.push_back(i);
      }
    }
  }

  /// Observations linearised about the field's motion, and the field's rows with residuals there.
  std::vector<ObservationRow> linearise(FrameField& field) {
    match_tags(field.position_mm);
    std::vector<ObservationRow> observations;
    field.rows.clear();
    field.tags_not_found.clear();
    field.points_not_found = points_not_found_;
    for (size_t n = 0; n < tags_.size(); ++n) {
      const size_t i = tags_[n];
      const TagPoint& tag = measurement_.tags[i];
      const std::optional<TagMatch>& match = matches_[n];
      if (!match) {
        field.tags_not_found.push_back(i);
        continue;
      }
      const Eigen::Vector3d direction = -match->by_motion;
      const double known_mm =
          match->error_mm + direction.dot(mesh_.value(field.displacement_mm, match->point));
      observations.push_back(
          {displacement_along(mesh_, match->point, direction), known_mm, tag.sigma_mm, 1.0});
      field.rows.push_back({true, i, 0, match->point, vector_of(tag.normal), tag.sigma_mm,
                            match->error_mm / tag.sigma_mm, false});
    }
    for (const auto& [i, point] : points_) {
      const ObservedPoint& seen = measurement_.points[i];
      const Eigen::Vector3d X_mm = mesh_.value(mesh_.reference(), point);
      const Eigen::Vector3d moved_mm = mesh_.value(field.displacement_mm, point);
      for (int k = 0; k < 3; ++k) {
        const double known_mm = seen.x_mm[static_cast<size_t>(k)] - X_mm[k];
        observations.push_back(
            {displacement_along(mesh_, point, Eigen::Vector3d::Unit(k)), known_mm, seen.sigma_mm, 1.0});
        field.rows.push_back({false, i, k, point, Eigen::Vector3d::Unit(k), seen.sigma_mm,
                              (known_mm - moved_mm[k]) / seen.sigma_mm, false});
      }
    }
    return observations;
  }

 private:
  /// Each tag from where the last motion had it, or else from its seen place.
  void match_tags(const NodeField& position_mm) {
    const PointLocator deformed(mesh_, position_mm, options_);
    matches_.resize(tags_.size());
    parallel_for(tags_.size(), machine_threads(), [&](size_t n) {
      const TagPoint& tag = measurement_.tags[tags_[n]];
      if (matches_[n]) matches_[n] = match_tag(reference_, deformed.elements(), tag, matches_[n]->point);
      if (matches_[n]) return;
      if (const auto guess = find_tag(deformed, tag))
        matches_[n] = match_tag(reference_, deformed.elements(), tag, *guess);
    });
  }

  const HermiteMesh& mesh_;
  const Measurement& measurement_;
  LocatorOptions options_;
  PointLocator reference_;
  std::vector<size_t> tags_;
  std::vector<std::optional<TagMatch>> matches_;
  std::vector<std::pair<size_t, MaterialPoint>> points_;
  std::vector<size_t> points_not_found_;
};

double spread_of(const FrameField& field) {
  std::vector<double> residuals;
  residuals.reserve(field.rows.size());
  for (const FieldRow& row : field.rows)
    residuals.push_back(row.residual);
  // A field of many freedoms takes part of the noise with it.
  const double left = field.residual_freedom > 0
                          ? std::max(0.05, field.residual_freedom / static_cast<double>(field.used()))
                          : 1.0;
  return robust_spread(std::move(residuals)) / std::sqrt(left);
}

/// Residuals of the linear problem at solution q, in units of sigma, whatever the rows' weights.
std::vector<double> linear_residuals(const FieldSpace& space, const std::vector<ObservationRow>& rows,
                                     const Eigen::VectorXd& q) {
  std::vector<double> residuals;
  residuals.reserve(rows.size());
  for (const ObservationRow& row : rows) {
    double fitted = 0.0;
    const auto& unknowns = space.element_unknowns(row.functional.element);
    for (size_t l = 0; l < element_coefficients; ++l) {
      if (unknowns[l] >= 0)
        fitted += row.functional.coefficients[static_cast<Eigen::Index>(l)] * q[unknowns[l]];
    }
    residuals.push_back((row.target - fitted) / row.sigma);
  }
  return residuals;
}

/// Root mean square of the motion that the rows ask for, from rest.
double seen_motion_mm(std::span<const ObservationRow> rows) {
  double squares = 0.0;
  for (const ObservationRow& row : rows)
    squares += row.target * row.target;
  return std::sqrt(squares / static_cast<double>(std::max<size_t>(rows.size(), 1)));
}

/// The first field: from rest, with Huber's weights, so that wild points do not tear it.
Eigen::VectorXd first_solution(SmoothedSystem& system, std::vector<ObservationRow>& rows, int rounds) {
  Eigen::VectorXd q;
  for (int round = 0; round < rounds; ++round) {
    if (round > 0) {
      const std::vector<double> residuals = linear_residuals(system.forms().space, rows, q);
      const double spread = std::max(robust_spread(residuals), least_scale);
      for (size_t i = 0; i < rows.size(); ++i)
        rows[i].weight = huber_weight(residuals[i] / spread);
    }
    system.set_rows(rows);
    system.factorise(first_lambda);
    q = system.solution();
  }
  return q;
}

/// Tukey's weights in their round, all or nothing after it. Returns how many rows are left out.
size_t weigh(std::vector<ObservationRow>& rows, FrameField& field) {
  field.scale = spread_of(field);
  size_t rejected = 0;
  for (size_t i = 0; i < rows.size(); ++i) {
    const double residual = field.rows[i].residual / std::max(field.scale, least_scale);
    field.rows[i].rejected = field.rounds > tukey_round && std::abs(residual) > reject_sigma;
    rows[i].weight = field.rounds == tukey_round ? tukey_weight(residual)
                     : field.rows[i].rejected    ? 0.0
                                                 : 1.0;
    rejected += field.rows[i].rejected ? 1 : 0;
  }
  return rejected;
}

/// What the system's present factorisation takes from the data, and what it leaves to the residuals.
void take_freedoms(FrameField& field) {
  const Eigen::MatrixXd signs = random_signs(field.system->weighted_rows().rows());
  field.degrees_of_freedom = stochastic_trace(*field.system, seen_signs(*field.system));
  field.residual_shares = residual_shares(*field.system, signs);
  for (size_t i = 0; i < field.rows.size(); ++i) {
    if (field.rows[i].rejected) field.residual_shares[static_cast<Eigen::Index>(i)] = 0.0;
  }
  field.residual_freedom = field.residual_shares.sum();
}

void move_to(FrameField& field, const FieldSpace& space, const Eigen::VectorXd& q) {
  field.displacement_mm = space.field_of(q);
  field.position_mm = space.mesh().reference();
  for (size_t dof = 0; dof < field.position_mm.size(); ++dof)
    field.position_mm[dof] += field.displacement_mm[dof];
}

}  // namespace

size_t FrameField::used() const {
  return static_cast<size_t>(
      std::count_if(rows.begin(), rows.end(), [](const FieldRow& row) { return !row.rejected; }));
}

double FrameField::chi2() const {
  double sum = 0.0;
  for (const FieldRow& row : rows)
    sum += row.rejected ? 0.0 : row.residual * row.residual;
  return sum;
}

const FrameField& most_loaded(const std::vector<FrameField>& fields) {
  return *std::max_element(fields.begin(), fields.end(), [](const FrameField& a, const FrameField& b) {
    return a.load.pressure_kPa < b.load.pressure_kPa;
  });
}

double robust_spread(std::vector<double> values) {
  if (values.empty()) return 0.0;
  for (double& value : values)
    value = std::abs(value);
  return signal::deviation_of_normal(std::move(values));
}

namespace {

/// Rows where the field has come to rest; which of them count is the last round's choice.
std::vector<ObservationRow> rows_at_rest(FrameData& data, FrameField& field) {
  using Source = std::tuple<bool, size_t, int>;
  std::set<Source> rejected_sources;
  for (const FieldRow& row : field.rows) {
    if (row.rejected) rejected_sources.insert({row.of_tag, row.source, row.component});
  }
  std::vector<ObservationRow> rows = data.linearise(field);
  for (size_t i = 0; i < rows.size(); ++i) {
    FieldRow& row = field.rows[i];
    row.rejected = rejected_sources.contains({row.of_tag, row.source, row.component});
    rows[i].weight = row.rejected ? 0.0 : 1.0;
  }
  return rows;
}

}  // namespace

FrameField reconstruct_frame(const FieldForms& forms, const Measurement& measurement, int frame,
                             const FrameOptions& options) {
  const FieldSpace& space = forms.space;
  FrameData data(space.mesh(), measurement, frame, options.locator);
  FrameField field;
  field.number = frame;
  field.load = measurement.frames[static_cast<size_t>(frame)];
  field.system = std::make_unique<SmoothedSystem>(forms);
  SmoothedSystem& system = *field.system;
  Eigen::VectorXd q = Eigen::VectorXd::Zero(space.unknowns());
  move_to(field, space, q);
  double lambda = options.lambda.value_or(first_lambda);
  size_t rejected = 0;
  double extent_mm = 0.0, weight_mm = 0.0;
  const auto rms_mm = [&](const Eigen::VectorXd& field_of) {
    return std::sqrt(forms.quadratic.apply(forms.sobolev.mean_square, field_of));
  };
  for (; field.rounds < most_rounds && !field.converged; ++field.rounds) {
    std::vector<ObservationRow> rows = data.linearise(field);
    Eigen::VectorXd moved;
    if (field.rounds == 0) {
      extent_mm = weight_mm = std::max(unseen_to_seen * seen_motion_mm(rows), least_extent_mm);
      system.set_extent_of_motion(extent_mm);
      moved = first_solution(system, rows, options.robust ? options.huber_rounds : 1);
    } else {
      const size_t before = rejected;
      if (options.robust) rejected = weigh(rows, field);
      system.set_rows(rows);
      // Again if the better field has changed its mind about wild points.
      const bool validate =
          field.rounds == validation_round || (field.rounds == last_validation_round && rejected != before);
      if (validate && !options.lambda) {
        field.smoothing = choose_lambda(system, options.fineness);
        lambda = field.smoothing.lambda;
      } else {
        system.factorise(lambda);
      }
      moved = system.solution();
    }
    for (int halving = 0; halving < most_halvings && rms_mm(moved) > extent_mm; ++halving) {
      weight_mm /= 2;
      system.set_extent_of_motion(weight_mm);
      system.factorise(system.lambda());
      moved = system.solution();
    }
    const double change_mm = rms_mm(moved - q);
    field.converged = field.rounds >= (options.lambda ? tukey_round + 1 : last_validation_round) &&
                      change_mm < options.settled_mm;
    q = moved;
    move_to(field, space, q);
  }
  field.smoothing.lambda = lambda;
  system.set_rows(rows_at_rest(data, field));
  system.factorise(lambda);
  take_freedoms(field);
  field.scale = spread_of(field);
  return field;
}

}  // namespace diastole
