#pragma once
// Fits the rig's model, with any effects, to a session's runs: least squares on whitened residuals.
//
// Unknowns: the specimen's modulus, one offset a sensor, and the effects' parameters in their search scales. The search
// is the one of estimator/inference. Its Jacobian is by differences of simulations with steps twice as long (the cavity's
// pressure errs by less than 0.1 Pa then, and most of it cancels), and is kept between the search's steps by Broyden's
// updates; columns and runs are simulated on several threads, and parameters that only the sensors see reuse the plant.

#include <Eigen/Dense>
#include <optional>
#include <string>
#include <vector>

#include "estimator/effects/effect.hpp"
#include "estimator/inference/parameter_space.hpp"
#include "estimator/inference/termination.hpp"
#include "estimator/model/specimen_family.hpp"
#include "estimator/rig_fit/noise_model.hpp"

namespace diastole::rig {

/// An effect that the model has, and the change points found for it.
struct ModelTerm {
  const Effect* effect = nullptr;
  std::vector<ChangePoint> change_points = {};
};

/// "modulus_kPa", "cavity_offset_Pa", "hose-compliance.wave_speed_m_s"
struct Unknown : inference::Parameter {
  double perturbation = 0.0;  ///< of the coordinate, for differences
  bool sensors_only = false;  ///< the plant does not depend on it

  /// The perturbation, its sign so that the coordinate stays within the bounds.
  [[nodiscard]] double step_from(double coordinate) const {
    return coordinate + perturbation > coordinate_bounds()[1] ? -perturbation : perturbation;
  }
};
Unknown unknown_of(const Effect& effect, const EffectParameter& parameter);
/// The value at `size` of the way from `neutral` to the parameter's typical value, in its search coordinate.
double sized_value(const EffectParameter& parameter, double neutral, double size);

/// The first unknowns of every model: the modulus and the sensors' offsets.
inline constexpr size_t nuisances = 3;

/// A model and a value for each of its unknowns.
struct KnownModel {
  std::vector<ModelTerm> terms;
  std::vector<double> values;  ///< natural
};

/// Where in the residuals one channel of one run stands.
struct ResidualBlock {
  size_t run = 0;
  std::string channel;  ///< "cavity_kPa", "pump_kPa", "cavity_mL"
  size_t first = 0;
  size_t count = 0;
};

struct RigFit : KnownModel {
  std::vector<Unknown> unknowns;
  std::vector<double>
      errors;  ///< standard errors; 0 for one held at its bound, infinite for one not determined
  Eigen::VectorXd residuals;  ///< whitened, at the end
  Eigen::MatrixXd jacobian;   ///< of the residuals by the search coordinates, at the last step
  double chi_square = 0.0;
  size_t count = 0;  ///< residuals that are fitted and not missing
  size_t iterations = 0;
  size_t simulations = 0;  ///< of the fitted runs, whatever their steps
  inference::Termination termination = inference::Termination::converged;

  [[nodiscard]] double reduced() const {
    return chi_square / static_cast<double>(count - std::min(values.size(), count - 1));
  }
  /// By name; NaN if there is none.
  [[nodiscard]] double value(std::string_view name) const;
};

/// Whitened residuals, or their means over a tenth of a second, which have no resonances and lead a search from afar.
enum class Fidelity { fine, coarse };

/// What a fit compares.
struct FitRequest {
  Fidelity fidelity = Fidelity::fine;
  std::vector<bool> runs = {};  ///< which of the session's runs; empty: all
  bool difference =
      false;  ///< only differences of what is returned count: longer steps, low-fidelity neighbours
};

/// All runs, for differences.
inline const FitRequest for_differences{.fidelity = Fidelity::fine, .runs = {}, .difference = true};

struct RigFitOptions {
  size_t threads = 2;
  int iteration_limit = 40;
  std::optional<KnownModel> variation_of = {};  ///< whose strokes vary; else the base model's, fitted
  std::optional<NoiseModel> noise = {};         ///< known from elsewhere; else estimated from the session
  SimulationOptions simulation{};  ///< steps are twice as long where there is no sensor at the pump
};

class RigProblem {
 public:
  /// `session` and `family` must outlive it.
  RigProblem(const Session& session, const SpecimenFamily& family, const RigFitOptions& options = {});

  [[nodiscard]] size_t threads() const { return options_.threads; }
  [[nodiscard]] const NoiseModel& noise() const { return noise_; }
  [[nodiscard]] const std::vector<ResidualBlock>& blocks() const { return blocks_; }
  /// The model without effects, fitted; made once.
  [[nodiscard]] const RigFit& base() const { return base_; }
  /// From `before`'s values and, for the terms that follow those of `before`, from the best of several sizes and signs of
  /// their typical ones. Precondition: `terms` begin with those of `before`.
  [[nodiscard]] RigFit fit(const std::vector<ModelTerm>& terms, const RigFit& before) const;
  /// The same from the base.
  [[nodiscard]] RigFit fit(const std::vector<ModelTerm>& terms) const { return fit(terms, base_); }
  /// From given values only. Runs that the request leaves out are not simulated; their residuals stay zero.
  [[nodiscard]] RigFit fit_from(const KnownModel& start, const FitRequest& request = {}) const;
  /// Derivatives of the residuals by the unknowns' search coordinates, a column each. An effect at its neutral value has
  /// columns too, except bubbles, which begin at 0.05 mL.
  [[nodiscard]] Eigen::MatrixXd columns(const KnownModel& at, const FitRequest& request = {}) const;
  [[nodiscard]] Eigen::VectorXd residuals(const KnownModel& of, const FitRequest& request = {}) const;
  /// What each run's instruments show by a model.
  [[nodiscard]] std::vector<Prediction> predictions(const KnownModel& of) const;
  [[nodiscard]] std::vector<Unknown> unknowns(const std::vector<ModelTerm>& terms) const;
  [[nodiscard]] RigModel model(const KnownModel& of, bool low_fidelity = false) const;

 private:
  /// With the steps of a fidelity.
  [[nodiscard]] PlantTrace plant(const RigModel& model, size_t run, Fidelity steps) const;
  /// Sets one run's rows of the residuals.
  void compare(const RigModel& model, const PlantTrace& plant, size_t run, Fidelity fidelity,
               Eigen::Ref<Eigen::VectorXd> out) const;
  void compare_channel(const ResidualBlock& block, Channel channel, const std::vector<double>& predicted,
                       Fidelity fidelity, Eigen::Ref<Eigen::VectorXd> out) const;
  void shrink_cycle_variations(size_t run, Eigen::Ref<Eigen::VectorXd> residuals) const;
  /// Seconds of a step for a fidelity.
  [[nodiscard]] double step_s(Fidelity fidelity) const;
  [[nodiscard]] std::vector<size_t> chosen_runs(const FitRequest& request) const;
  [[nodiscard]] size_t count_rows(const FitRequest& request) const;
  /// Models from which a fit of more terms than `before` may start, the best first.
  [[nodiscard]] std::vector<KnownModel> starts(const std::vector<ModelTerm>& terms, const RigFit& before,
                                               size_t& simulations) const;
  void set_blocks();
  void set_cycle_variations(const KnownModel& of);
  /// Whitened change of each run's channels by the strokes of a group of cycles (cycle_variation.cpp), per relative change.
  [[nodiscard]] std::vector<std::map<Channel, std::vector<double>>> variation_shapes(const KnownModel& of,
                                                                                     size_t group) const;

  const Session& session_;
  const SpecimenFamily& family_;
  RigFitOptions options_;
  NoiseModel noise_;
  std::vector<ResidualBlock> blocks_;
  std::vector<DriveTrace> motions_, coarse_motions_;  ///< of each run, at the steps of both fidelities
  size_t rows_ = 0;
  std::vector<size_t> present_;  ///< rows of each block that are not missing

  /// A cycle's whitened shape in all channels, of unit length, and which part of it is taken off.
  struct CycleVariation {
    size_t run = 0;
    std::vector<CycleRows> rows;
    Eigen::VectorXd direction;
    double shrinkage = 0.0;
  };
  std::vector<CycleVariation> variations_;
  RigFit base_;
};

}  // namespace diastole::rig
