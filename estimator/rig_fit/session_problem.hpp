#pragma once
// A session as a problem in features: what a model with its tolerances and effects would show.

#include <memory>
#include <span>

#include "estimator/model/specimen_family.hpp"
#include "estimator/rig_fit/model_error.hpp"
#include "estimator/rig_fit/model_term.hpp"
#include "estimator/rig_fit/tolerance.hpp"

namespace diastole::rig {

/// Of the tolerances, in sds of their list's: N(mean, root root').
struct TolerancePrior {
  Eigen::VectorXd mean;
  Eigen::MatrixXd root;
  /// Sds of the parts as described, whatever references taught: 1, or less where they are taken for finer.
  Eigen::VectorXd described;
};

/// Effects with their values, and the nuisances: modulus, sensors' offsets, tolerances, each N(0, 1) by its prior. Where a
/// reference says more of the tolerances, theirs are independent combinations of them.
struct SessionModel {
  std::vector<ModelTerm> terms;
  std::vector<double> values;                        ///< of the effects, natural
  Eigen::VectorXd nuisances;                         ///< u, in sds of their priors
  std::shared_ptr<const TolerancePrior> prior = {};  ///< where it is not the problem's
};

struct Nuisance {
  std::string name;
  std::string unit;
  double sd = 0.0;
  double mean = 0.0;  ///< of the value at u = 0
  bool sensors_only = false;
  const Tolerance* tolerance = nullptr;  ///< none: the modulus, an offset
  bool is_stated = false;                ///< the rig's description says how large

  /// Known to an order of magnitude only, by no data sheet.
  [[nodiscard]] bool is_guess() const { return unit == "ln" && sd >= 0.5; }
};

/// Those before the tolerances.
inline constexpr size_t basic_nuisances = 3;

class SessionProblem {
 public:
  /// `session` and `family` must outlive it. Of the tolerances that only references teach those of `learnt` are unknowns.
  SessionProblem(const Session& session, const SpecimenFamily& family, size_t threads,
                 std::span<const std::string_view> learnt = {});

  [[nodiscard]] const Session& session() const { return session_; }
  [[nodiscard]] const SpecimenFamily& family() const { return family_; }
  [[nodiscard]] const NoiseModel& noise() const { return noise_; }
  [[nodiscard]] const SegmentFeatures& features() const { return features_; }
  [[nodiscard]] ModelError& error() { return error_; }
  /// What was measured, less what is known of the rig's own misfit.
  [[nodiscard]] const Eigen::VectorXd& measured() const { return measured_; }
  void take_off(const Eigen::VectorXd& misfit) { measured_ -= misfit; }
  /// Learnt from references: N(mean, root root').
  void set_tolerances(Eigen::VectorXd mean, Eigen::MatrixXd root) {
    prior_.mean = std::move(mean);
    prior_.root = std::move(root);
    is_learnt_ = true;
  }
  [[nodiscard]] bool is_learnt() const { return is_learnt_; }
  /// Of parts that are so many times finer than the list says; those whose sizes the rig's description states, and guesses
  /// of an order of magnitude, are not.
  [[nodiscard]] TolerancePrior finer_prior(double times) const;
  /// Of a model's tolerances.
  [[nodiscard]] const TolerancePrior& prior(const SessionModel& of) const {
    return of.prior ? *of.prior : prior_;
  }
  /// The tolerances of a model, in sds of their list's.
  [[nodiscard]] Eigen::VectorXd tolerances(const SessionModel& of) const {
    return prior(of).mean + prior(of).root * of.nuisances.tail(prior(of).mean.size());
  }
  [[nodiscard]] const ModelError& error() const { return error_; }
  [[nodiscard]] const std::vector<Nuisance>& nuisances() const { return nuisances_; }
  [[nodiscard]] size_t threads() const { return threads_; }

  [[nodiscard]] RigModel model(const SessionModel& of) const;
  /// Features that models would show, a column each. Those for which `same_plant` is set differ from the first one
  /// only in what the sensors show.
  [[nodiscard]] Eigen::MatrixXd predicted_features(std::span<const SessionModel> models,
                                                   const std::vector<bool>& same_plant = {}) const;
  /// How what is shown changes with u, by differences of half a tolerance's sd: the range that a linear fit goes through.
  /// `there`: what is shown at it.
  [[nodiscard]] Eigen::MatrixXd nuisance_columns(const SessionModel& at, Eigen::VectorXd& there) const;
  /// Derivatives of what is shown by u, by differences of a two hundredth of a tolerance's sd: data of a hundred thousand
  /// samples know one to a hundredth, and slopes over more are no search's. To `both_sides` they take twice as long, and no
  /// curvature is in them: where u are combinations of parts whose slopes nearly cancel, that of a single part may be all there
  /// is.
  [[nodiscard]] Eigen::MatrixXd nuisance_slopes(const SessionModel& at, Eigen::VectorXd& there,
                                                bool both_sides = false) const;
  /// What the instruments show of one run.
  [[nodiscard]] RunPrediction predict_run(size_t run, const SessionModel& of) const;

 private:
  /// Steps of this part of an sd, of u's first and of the tolerances one by one.
  [[nodiscard]] Eigen::VectorXd nuisance_steps(const SessionModel& at, double part) const;
  /// The model with each of the steps taken for itself.
  [[nodiscard]] std::vector<RigModel> stepped(const SessionModel& at, const Eigen::VectorXd& steps) const;
  /// By u, over this part of a tolerance's sd.
  [[nodiscard]] Eigen::MatrixXd differences(const SessionModel& at, double part, bool both_sides,
                                            Eigen::VectorXd& there) const;
  /// Of derivatives by the steps, those by u.
  [[nodiscard]] Eigen::MatrixXd by_u(const SessionModel& at, Eigen::MatrixXd by_steps) const;
  /// With these tolerances, in sds of their list's, whatever u says.
  [[nodiscard]] RigModel model(const SessionModel& of, const Eigen::VectorXd& tolerances) const;
  [[nodiscard]] Eigen::MatrixXd predicted_features(std::span<const RigModel> made,
                                                   const std::vector<bool>& same_plant) const;
  [[nodiscard]] PlantTrace plant(const RigModel& model, size_t run) const;
  [[nodiscard]] RunPrediction predict_run(size_t run, const RigModel& model, const PlantTrace& plant) const;

  const Session& session_;
  const SpecimenFamily& family_;
  size_t threads_;
  NoiseModel noise_;
  SegmentFeatures features_;
  ModelError error_;
  Eigen::VectorXd measured_;
  std::vector<Nuisance> nuisances_;
  TolerancePrior prior_;  ///< the list's, if no reference says more
  bool is_learnt_ = false;
  std::vector<DriveTrace> smooth_motions_, abrupt_motions_;  ///< of each run
};

}  // namespace diastole::rig
