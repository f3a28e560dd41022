#include "estimator/montecarlo/imaging_design.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "estimator/fit/estimated_parameters.hpp"
#include "estimator/fit/study_fit.hpp"
#include "estimator/fit/study_motion.hpp"
#include "estimator/fit/unloaded_motion.hpp"
#include "estimator/inference/covariance.hpp"
#include "estimator/mesh/point_locator.hpp"
#include "estimator/model/affected_model.hpp"
#include "estimator/model/study_model.hpp"
#include "estimator/montecarlo/synthetic_data.hpp"
#include "protocol/contract/angle.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

using Eigen::Vector3d;

constexpr double apart_in_spacings = 0.8;
constexpr double sure_in_pixels = 1.25;
constexpr double most_sigma_in_spacings = 0.5;   // a line that is known no better is lost
constexpr double least_spacing_in_pixels = 3.0;  // finer tags look like their mirror images
constexpr size_t fewest_points = 30;

/// A slice through the specimen's origin or across its axis.
struct Slice {
  Vector3d centre_mm, along_row, along_column;
};

std::vector<Slice> slices_of(const ImagingPlan& plan) {
  std::vector<Slice> slices;
  for (const double z_mm : plan.short_axis_mm)
    slices.push_back({z_mm * Vector3d::UnitZ(), Vector3d::UnitX(), Vector3d::UnitY()});
  for (const double angle_deg : plan.long_axis_deg) {
    const double angle = angle_deg * rad_per_deg;
    slices.push_back({Vector3d::Zero(), {std::cos(angle), std::sin(angle), 0}, -Vector3d::UnitZ()});
  }
  return slices;
}

/// Whether a place and its surroundings within the slice are tissue.
class Tissue {
 public:
  Tissue(const HermiteMesh& mesh, double edge_mm)
      : locator_(mesh, mesh.reference(), {.outside_xi = 1e-6}), edge_mm_(edge_mm) {}

  [[nodiscard]] bool surely_holds(const Vector3d& place_mm, const Slice& slice) const {
    if (!locator_.find(place_mm)) return false;
    for (int way = 0; way < 8; ++way) {
      const double angle = way * std::numbers::pi / 4;
      if (!locator_.find(place_mm + edge_mm_ * (std::cos(angle) * slice.along_row +
                                                std::sin(angle) * slice.along_column)))
        return false;
    }
    return true;
  }

 private:
  PointLocator locator_;
  double edge_mm_;
};

std::array<double, 3> components(const Vector3d& v) { return {v[0], v[1], v[2]}; }

struct Change {
  std::string words;
  ImagingPlan plan;
  std::vector<Frame> frames;
  double pressure_error = 1;  ///< of all pressures, times the stated one
};

/// Every second frame, the highest pressure's among them; or one more between any two.
std::vector<Frame> thinned(const std::vector<Frame>& frames) {
  const auto highest = std::max_element(frames.begin() + 1, frames.end(), [](const Frame& a, const Frame& b) {
    return a.pressure_kPa < b.pressure_kPa;
  });
  const auto parity = (highest - frames.begin()) % 2;
  std::vector<Frame> fewer = {frames.front()};
  for (size_t k = 1; k < frames.size(); ++k) {
    if (static_cast<std::ptrdiff_t>(k) % 2 == parity) fewer.push_back(frames[k]);
  }
  return fewer;
}

std::vector<Frame> doubled(const std::vector<Frame>& frames) {
  std::vector<Frame> more = {frames.front()};
  for (size_t k = 1; k < frames.size(); ++k) {
    if (k > 1)
      more.push_back({0.5 * (frames[k - 1].time_s + frames[k].time_s),
                      0.5 * (frames[k - 1].pressure_kPa + frames[k].pressure_kPa), frames[k].sigma_kPa});
    more.push_back(frames[k]);
  }
  return more;
}

std::vector<Change> changes_of(const ImagingPlan& plan, const std::vector<Frame>& frames) {
  std::vector<Change> changes;
  const auto add = [&](std::string words, const auto& make) {
    Change change{std::move(words), plan, frames};
    make(change);
    changes.push_back(std::move(change));
  };
  for (const double factor : {0.7, 1.5}) {
    if (factor * plan.tag_spacing_mm < least_spacing_in_pixels * plan.pixel_mm) continue;
    add(fmt::format("tags every {:.3g} mm", factor * plan.tag_spacing_mm),
        [&](Change& change) { change.plan.tag_spacing_mm *= factor; });
  }
  for (const double factor : {0.5, 2.0})
    add(fmt::format("signal to noise {:.3g}", factor * plan.snr),
        [&](Change& change) { change.plan.snr *= factor; });
  add("one direction of tags", [&](Change& change) { change.plan.tag_angles_deg.resize(1); });
  add("two more slices across the axis", [&](Change& change) {
    for (const double z_mm : {-15.0, 15.0})
      change.plan.short_axis_mm.push_back(z_mm);
  });
  add("two more slices along the axis", [&](Change& change) {
    for (const double angle_deg : {30.0, 120.0})
      change.plan.long_axis_deg.push_back(angle_deg);
  });
  if (frames.size() > 3) add("half the phases", [&](Change& change) { change.frames = thinned(frames); });
  add("twice the phases", [&](Change& change) { change.frames = doubled(frames); });
  add("pressures measured twice as exactly", [&](Change& change) { change.pressure_error = 0.5; });
  return changes;
}

class Predictor {
 public:
  Predictor(const Study& study, bool unload) : study_(study) {
    ElasticModel model = make_affected_model(study);
    require_cavity(study, model);
    estimated_ = estimated_parameters(study, model);
    motion_ = study_motion(study, std::move(model), estimated_.groups, unload);
    imaged_ = motion_->imaged_load();
  }

  [[nodiscard]] std::vector<double> se_percent(const ImagingPlan& plan, std::vector<Frame> frames,
                                               double pressure_error = 1) {
    for (Frame& frame : frames)
      frame.sigma_kPa *= pressure_error;
    if (auto* unloaded = dynamic_cast<UnloadedMotion*>(motion_.get()))
      unloaded->set_imaged_load({imaged_->pressure_kPa, pressure_error * imaged_->sigma_kPa});
    const std::vector<double> values = estimated_.starts();
    std::vector<NodeField> motions(1);
    for (size_t k = 1; k < frames.size(); ++k) {
      MotionOutcome outcome = motion_->solve(k - 1, values, frames[k].pressure_kPa);
      if (!outcome.position_mm)
        throw InputError({study_.file.string(), fmt::format("pressure {:.3g} kPa", frames[k].pressure_kPa),
                          outcome.reason, "Give other values with --set."});
      motions.push_back(std::move(*outcome.position_mm));
    }
    Measurement measurement = exact_measurement(motion_->mesh(), planned_tags(motion_->mesh(), plan, frames),
                                                motions, locator_for(study_.specimen));
    measurement.planes_as_seen = true;
    if (measurement.tags.size() < fewest_points)
      throw InputError({study_.file.string(), "",
                        fmt::format("the plan sees {} points of tags", measurement.tags.size()),
                        "Put slices through the specimen, with tags that its wall is wide enough for."});
    JointProblem problem(*motion_, estimated_.values, measurement, locator_for(study_.specimen));
    const Eigen::VectorXd q = problem.start();
    if (!problem.find_points(q) || !problem.residuals(q))
      throw InputError({study_.file.string(), "", fmt::format("cannot be solved: {}", problem.failure()),
                        "Give other values with --set."});
    const Eigen::MatrixXd covariance = inference::estimate_covariance(problem.jacobian(q)).matrix;
    return estimated_.se_percent(covariance);
  }

 private:
  const Study& study_;
  EstimatedParameters estimated_;
  std::unique_ptr<ElasticMotion> motion_;
  std::optional<ImagedLoad> imaged_;
};

}  // namespace

Measurement planned_tags(const HermiteMesh& mesh, const ImagingPlan& plan, const std::vector<Frame>& frames) {
  Measurement measurement;
  measurement.frames = frames;
  measurement.planes_as_seen = true;
  const Tissue tissue(mesh, sure_in_pixels * plan.pixel_mm);
  const double step_mm = apart_in_spacings * plan.tag_spacing_mm;
  const double area = step_mm * plan.tag_spacing_mm / (plan.pixel_mm * plan.pixel_mm);
  const int reach = static_cast<int>(std::ceil(mesh.extent_mm() / step_mm));
  for (const Slice& slice : slices_of(plan)) {
    for (const double angle_deg : plan.tag_angles_deg) {
      const double angle = angle_deg * rad_per_deg;
      const Vector3d normal = std::cos(angle) * slice.along_row + std::sin(angle) * slice.along_column;
      const Vector3d along = std::cos(angle) * slice.along_column - std::sin(angle) * slice.along_row;
      for (int line = -reach; line <= reach; ++line) {
        for (int place = -reach; place <= reach; ++place) {
          const Vector3d X_mm =
              slice.centre_mm + line * plan.tag_spacing_mm * normal + place * step_mm * along;
          if (!tissue.surely_holds(X_mm, slice)) continue;
          for (size_t k = 1; k < frames.size(); ++k) {
            const double modulation = std::exp(-frames[k].time_s / plan.T1_s);
            const double slope = std::numbers::pi * modulation * plan.snr / plan.tag_spacing_mm;
            const double sigma_mm = 1 / std::sqrt(0.5 * slope * slope * area);
            if (sigma_mm > most_sigma_in_spacings * plan.tag_spacing_mm) continue;
            measurement.tags.push_back(
                {static_cast<int>(k), components(normal), normal.dot(X_mm), components(X_mm), sigma_mm});
          }
        }
      }
    }
  }
  return measurement;
}

DesignStudy explore_imaging(const Study& study, const std::vector<Frame>& frames, const ImagingPlan& plan,
                            bool unload) {
  if (plan.tag_spacing_mm < least_spacing_in_pixels * plan.pixel_mm)
    throw InputError({"", "--tag-spacing, --pixel",
                      fmt::format("tags every {:g} mm are less than three pixels of {:g} mm apart",
                                  plan.tag_spacing_mm, plan.pixel_mm),
                      "Space the tags farther apart, or plan smaller pixels."});
  Predictor predictor(study, unload);
  DesignStudy result(study, predictor.se_percent(plan, frames));
  for (Change& change : changes_of(plan, frames)) {
    DesignOption option{std::move(change.words),
                        predictor.se_percent(change.plan, change.frames, change.pressure_error), 1.0};
    for (size_t i = 0; i < option.se_percent.size(); ++i)
      option.volume *= option.se_percent[i] / result.se_percent[i];
    result.options.push_back(std::move(option));
  }
  result.rank();
  return result;
}

}  // namespace diastole
