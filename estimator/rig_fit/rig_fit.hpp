#pragma once
// Fits the rig's model, with any effects, to a session's runs: least squares on whitened residuals.
//
// Unknowns: the specimen's modulus, one offset a sensor, and the effects' parameters in their search scales. The
// Jacobian is by differences of simulations with steps twice as long (the cavity's pressure errs by less than 0.1 Pa
// then, and most of it cancels), and is kept between the search's steps by Broyden's updates until they have led far;
// columns and runs are simulated on several threads, and parameters that only the sensors see reuse the plant. Steps
// are damped (Levenberg-Marquardt); an unknown that is pushed against its bound is held there.

#include <Eigen/Dense>
#include <optional>
#include <string>
#include <vector>

#include "estimator/effects/effect.hpp"
#include "estimator/model/specimen_family.hpp"
#include "estimator/rig_fit/noise_model.hpp"

namespace diastole::rig {

/// An effect that the model has, and the moments found for it.
struct Ingredient {
  const Effect* effect = nullptr;
  std::vector<Occasion> occasions = {};
};

struct Unknown {
  std::string name;  ///< "modulus_kPa", "cavity_offset_Pa", "hose-compliance.wave_speed_m_s"
  double lower = 0.0;
  double upper = 0.0;
};

/// Where in the residuals one channel of one run stands.
struct ResidualBlock {
  size_t run = 0;
  std::string channel;  ///< "cavity_kPa", "pump_kPa", "cavity_mL"
  size_t first = 0;
  size_t count = 0;
};

struct RigFit {
  std::vector<Ingredient> ingredients;
  std::vector<Unknown> unknowns;
  std::vector<double> values;  ///< natural, as in `unknowns`
  std::vector<double> errors;  ///< standard errors; 0 for one held at its bound
  Eigen::VectorXd residuals;   ///< whitened, at the end
  Eigen::MatrixXd jacobian;    ///< of the residuals by the search coordinates, at the last step
  double chi_square = 0.0;
  size_t count = 0;  ///< residuals that are fitted and not missing
  size_t iterations = 0;
  size_t simulations = 0;  ///< of the fitted runs, whatever their steps
  bool converged = false;

  [[nodiscard]] double reduced() const {
    return chi_square / static_cast<double>(count - std::min(values.size(), count - 1));
  }
  /// By name; NaN if there is none.
  [[nodiscard]] double value(std::string_view name) const;
};

/// Whitened residuals, or their means over a tenth of a second, which know no resonances and lead a search from afar.
enum class Look { fine, coarse };

/// What a fit compares.
struct FitRequest {
  Look look = Look::fine;
  std::vector<bool> runs = {};  ///< which of the session's runs; empty: all
  bool difference = false;  ///< only differences of what is returned count: longer steps, rough neighbours
};

/// All runs, for differences.
inline const FitRequest of_difference{.look = Look::fine, .runs = {}, .difference = true};

/// Effects and all unknowns' values of a fit that was made before.
struct KnownModel {
  std::vector<Ingredient> ingredients;
  std::vector<double> values;
};

struct RigFitOptions {
  size_t threads = 2;
  size_t most_iterations = 40;
  std::optional<KnownModel> beats_of = {};  ///< whose strokes vary; else the base model's, fitted
  std::optional<NoiseModel> noise = {};     ///< known from elsewhere; else estimated from the session
  SimulationOptions simulation{};           ///< steps are twice as long where there is no sensor at the pump
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
  /// From `before`'s values and, for the ingredients that follow those of `before`, from the best of several sizes and
  /// signs of their typical ones. Precondition: `ingredients` begin with those of `before`.
  [[nodiscard]] RigFit fit(const std::vector<Ingredient>& ingredients, const RigFit& before) const;
  /// The same from the base.
  [[nodiscard]] RigFit fit(const std::vector<Ingredient>& ingredients) const {
    return fit(ingredients, base_);
  }
  /// From given values only. Runs that the request leaves out are not simulated; their residuals stay zero.
  [[nodiscard]] RigFit fit_from(const std::vector<Ingredient>& ingredients, const std::vector<double>& values,
                                const FitRequest& request) const;
  [[nodiscard]] RigFit fit_from(const std::vector<Ingredient>& ingredients, const std::vector<double>& values,
                                Look look = Look::fine) const {
    return fit_from(ingredients, values, FitRequest{.look = look, .runs = {}});
  }
  /// Derivatives of the residuals by the unknowns' search coordinates at these values, a column each from `first` on
  /// (3: without modulus and offsets). An effect at its neutral value has columns too, except bubbles, which begin
  /// at 0.05 mL.
  [[nodiscard]] Eigen::MatrixXd columns(const std::vector<Ingredient>& ingredients,
                                        const std::vector<double>& values, const FitRequest& request = {},
                                        size_t first = 0) const;
  [[nodiscard]] Eigen::VectorXd residuals(const std::vector<Ingredient>& ingredients,
                                          const std::vector<double>& values, const FitRequest& request) const;
  [[nodiscard]] Eigen::VectorXd residuals(const std::vector<Ingredient>& ingredients,
                                          const std::vector<double>& values, Look look = Look::fine) const {
    return residuals(ingredients, values, FitRequest{.look = look, .runs = {}});
  }
  /// What each run's instruments show by a model.
  [[nodiscard]] std::vector<Prediction> predictions(const std::vector<Ingredient>& ingredients,
                                                    const std::vector<double>& values) const;
  [[nodiscard]] std::vector<Unknown> unknowns(const std::vector<Ingredient>& ingredients) const;
  [[nodiscard]] RigModel model(const std::vector<Ingredient>& ingredients, const std::vector<double>& values,
                               bool rough = false) const;

 private:
  /// With the steps of a look.
  [[nodiscard]] PlantTrace plant(const RigModel& model, size_t run, Look steps) const;
  /// Sets one run's rows of the residuals.
  void compare(const RigModel& model, const PlantTrace& plant, size_t run, Look look,
               Eigen::Ref<Eigen::VectorXd> out) const;
  void compare_channel(const ResidualBlock& block, Channel channel, const std::vector<double>& predicted,
                       Look look, Eigen::Ref<Eigen::VectorXd> out) const;
  void shrink_beats(size_t run, Eigen::Ref<Eigen::VectorXd> residuals) const;
  /// Seconds of a step for a look.
  [[nodiscard]] double step_s(Look look) const;
  [[nodiscard]] std::vector<size_t> chosen_runs(const FitRequest& request) const;
  [[nodiscard]] size_t count_rows(const FitRequest& request) const;
  /// Values from which a fit of more ingredients than `before` may start, the best first.
  [[nodiscard]] std::vector<std::vector<double>> starts(const std::vector<Ingredient>& ingredients,
                                                        const RigFit& before, size_t& simulations) const;
  void set_blocks();
  void set_beats(const KnownModel& of);
  /// Whitened change of each run's channels by the strokes of a group of cycles (beats.cpp), per relative change.
  [[nodiscard]] std::vector<std::map<Channel, std::vector<double>>> beat_shapes(const KnownModel& of,
                                                                                size_t group) const;

  const Session& session_;
  const SpecimenFamily& family_;
  RigFitOptions options_;
  NoiseModel noise_;
  std::vector<ResidualBlock> blocks_;
  std::vector<DriveTrace> motions_, coarse_motions_;  ///< of each run, at the steps of both looks
  size_t rows_ = 0;
  std::vector<size_t> present_;  ///< rows of each block that are not missing

  /// A cycle's whitened shape in all channels, of unit length, and how much of it is taken off.
  struct Beat {
    size_t run = 0;
    std::vector<CycleRows> rows;
    Eigen::VectorXd direction;
    double taken = 0.0;
  };
  std::vector<Beat> beats_;
  RigFit base_;
};

}  // namespace diastole::rig
