#include "estimator/montecarlo/design.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "estimator/fit/estimated_parameters.hpp"
#include "estimator/fit/study_fit.hpp"
#include "estimator/fit/study_motion.hpp"
#include "estimator/fit/usable_points.hpp"
#include "estimator/inference/information.hpp"
#include "estimator/model/affected_model.hpp"
#include "estimator/model/study_model.hpp"
#include "estimator/montecarlo/synthetic_data.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr double most_se_percent = 1e4;  // a hundred times its value: nothing is known about a parameter
constexpr double new_frames[] = {0.25, 0.5, 0.75, 1.0, 1.25, 1.5};  // of the highest pressure so far

/// The information of one frame, its pressure not yet eliminated. "Values" are the parameters', and last the pressure of an image under load that is
/// not exactly known.
struct FrameInformation {
  int number;
  double pressure_kPa;
  double sigma_kPa;
  Eigen::MatrixXd by_values;
  Eigen::VectorXd by_both;
  double by_pressure;

  /// Without its pressure, with `points` times the points and the pressure's error `error` times as large.
  [[nodiscard]] Eigen::MatrixXd marginal(double points = 1, double error = 1) const {
    const double sigma = error * sigma_kPa;
    if (!(sigma > 0)) return points * by_values;
    const double of_pressure = points * by_pressure + 1 / (sigma * sigma);
    return points * by_values - points * points * by_both * by_both.transpose() / of_pressure;
  }
};

class Explorer {
 public:
  Explorer(const Study& study, Measurement measurement, bool unload)
      : study_(study), measurement_(std::move(measurement)), model_(make_affected_model(study)) {
    require_cavity(study_, model_);
    estimated_ = estimated_parameters(study_, model_);
    // Every frame's derivative by its pressure is wanted, known exactly or not.
    for (const Frame& frame : measurement_.frames)
      stated_sigma_kPa_.push_back(frame.sigma_kPa);
    motion_ = study_motion(study, std::move(model_), estimated_.groups, unload);
  }

  [[nodiscard]] std::vector<FrameInformation> present() {
    return information_of(measurement_, stated_sigma_kPa_);
  }

  /// Of frames with the points of the highest one at other pressures; those without equilibrium are left out.
  [[nodiscard]] std::vector<FrameInformation> at_new_pressures(const FrameInformation& highest) {
    Measurement design;
    design.frames = {measurement_.frames.front()};
    std::vector<NodeField> motions(1);
    const std::vector<double> values = estimated_.starts();
    for (const double share : new_frames) {
      const double pressure_kPa = share * highest.pressure_kPa;
      MotionOutcome outcome = motion_->solve(0, values, pressure_kPa);
      if (!outcome.position_mm) continue;
      const int frame = static_cast<int>(design.frames.size());
      design.frames.push_back({0.1 * frame, pressure_kPa, highest.sigma_kPa});
      motions.push_back(std::move(*outcome.position_mm));
      for (TagPoint tag : measurement_.tags) {
        if (tag.frame != highest.number) continue;
        tag.frame = frame;
        design.tags.push_back(tag);
      }
      for (ObservedPoint point : measurement_.points) {
        if (point.frame != highest.number) continue;
        point.frame = frame;
        design.points.push_back(point);
      }
    }
    const Measurement exact =
        exact_measurement(motion_->mesh(), design, motions, locator_for(study_.specimen));
    return information_of(exact, std::vector<double>(design.frames.size(), highest.sigma_kPa));
  }

  /// Of the parameters' values, from all frames together; `error` as in FrameInformation::marginal.
  [[nodiscard]] Eigen::MatrixXd of_parameters(const Eigen::MatrixXd& all, double error = 1) const {
    const auto values = static_cast<Eigen::Index>(estimated_.values.size());
    Eigen::MatrixXd information = all.topLeftCorner(values, values);
    const double sigma_kPa = all.rows() > values ? error * motion_->imaged_load().value().sigma_kPa : 0.0;
    if (!(sigma_kPa > 0)) return information;
    const Eigen::VectorXd by_both = all.col(values).head(values);
    information -= by_both * by_both.transpose() / (all(values, values) + 1 / (sigma_kPa * sigma_kPa));
    return information;
  }

  /// Relative standard errors of the study's parameters, in %.
  [[nodiscard]] std::vector<double> se_percent(const Eigen::MatrixXd& information) const {
    return estimated_.se_percent(inference::covariance_of_information(information).matrix);
  }

 private:
  [[nodiscard]] std::vector<FrameInformation> information_of(Measurement measurement,
                                                             const std::vector<double>& sigma_kPa) {
    for (Frame& frame : measurement.frames)
      frame.sigma_kPa = 1;  // an unknown of its own; its prior is put in by `marginal`
    JointProblem problem(*motion_, estimated_.values, measurement, locator_for(study_.specimen));
    const Eigen::VectorXd q = problem.start();
    if (!problem.find_points(q) || !problem.residuals(q)) {
      throw InputError({study_.file.string(), "", fmt::format("cannot be solved: {}", problem.failure()),
                        "Give other values with --set."});
    }
    require_half_usable(point_share(problem), study_.file.string());
    const Eigen::MatrixXd jacobian = problem.jacobian(q);
    std::vector<FrameInformation> frames;
    Eigen::Index row = 0;
    for (const JointProblem::LoadedFrame& frame : problem.frames()) {
      const Eigen::MatrixXd rows = jacobian.middleRows(row, frame.residuals.size());
      row += frame.residuals.size();
      Eigen::MatrixXd by_values = rows.leftCols(problem.values());
      if (const auto imaged = problem.imaged_unknown()) {
        by_values.conservativeResize(Eigen::NoChange, by_values.cols() + 1);
        by_values.rightCols<1>() = rows.col(*imaged);
      }
      const Eigen::VectorXd by_pressure = rows.col(*frame.pressure_unknown);
      frames.push_back({frame.number, frame.load.pressure_kPa, sigma_kPa[static_cast<size_t>(frame.number)],
                        by_values.transpose() * by_values, by_values.transpose() * by_pressure,
                        by_pressure.squaredNorm()});
    }
    return frames;
  }

  const Study& study_;
  Measurement measurement_;
  ElasticModel model_;
  EstimatedParameters estimated_;
  std::vector<double> stated_sigma_kPa_;
  std::unique_ptr<ElasticMotion> motion_;
};

Eigen::MatrixXd total(const std::vector<FrameInformation>& frames, double points = 1, double error = 1) {
  Eigen::MatrixXd sum =
      Eigen::MatrixXd::Zero(frames.front().by_values.rows(), frames.front().by_values.cols());
  for (const FrameInformation& frame : frames)
    sum += frame.marginal(points, error);
  return sum;
}

double log_determinant(const Eigen::MatrixXd& information) {
  return information.ldlt().vectorD().array().abs().max(1e-300).log().sum();
}

}  // namespace

DesignStudy::DesignStudy(const Study& study, std::vector<double> now) : se_percent(std::move(now)) {
  for (const StudyParameter& parameter : study.law.parameters) {
    parameters.push_back(parameter.name);
    values.push_back(parameter.start);
    if (se_percent[parameters.size() - 1] < most_se_percent) continue;
    throw InputError({study.file.string(), "table [data]",
                      fmt::format("says nothing about {}", parameter.name),
                      "Give frames with a load at which the body moves, or hold the parameter."});
  }
}

void DesignStudy::rank() { std::ranges::stable_sort(options, {}, &DesignOption::volume); }

DesignStudy explore_design(const Study& study, const Measurement& measurement, bool unload) {
  require_loaded_points(study, measurement);
  Explorer explorer(study, measurement, unload);
  const std::vector<FrameInformation> frames = explorer.present();
  const Eigen::MatrixXd present = total(frames), now = explorer.of_parameters(present);
  DesignStudy result(study, explorer.se_percent(now));
  const auto add = [&](std::string change, const Eigen::MatrixXd& all, double error = 1) {
    const Eigen::MatrixXd information = explorer.of_parameters(all, error);
    result.options.push_back({std::move(change), explorer.se_percent(information),
                              std::exp(0.5 * (log_determinant(now) - log_determinant(information)))});
  };
  add("half the tag spacing (twice the points in every frame)", total(frames, 2));
  add("half the points' noise", total(frames, 4));
  add("pressures measured twice as exactly", total(frames, 1, 0.5), 0.5);
  add("pressures known exactly", total(frames, 1, 0), 0);
  for (const FrameInformation& frame : frames) {
    add(fmt::format("frame {} ({:.3g} kPa) imaged twice", frame.number, frame.pressure_kPa),
        present - frame.marginal() + frame.marginal(2));
    if (frames.size() > 1)
      add(fmt::format("without frame {} ({:.3g} kPa)", frame.number, frame.pressure_kPa),
          present - frame.marginal());
  }
  const auto highest = std::max_element(frames.begin(), frames.end(), [](const auto& a, const auto& b) {
    return a.pressure_kPa < b.pressure_kPa;
  });
  for (const FrameInformation& frame : explorer.at_new_pressures(*highest))
    add(fmt::format("one more frame at {:.3g} kPa", frame.pressure_kPa), present + frame.marginal());
  result.rank();
  return result;
}

}  // namespace diastole
