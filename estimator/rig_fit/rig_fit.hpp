#pragma once
// Fits the rig's model, with any effects, to a session's runs: least squares on whitened residuals.
//
// Unknowns: the specimen's modulus, one offset a sensor, and the effects' parameters in their search scales. The
// Jacobian is by differences; runs are simulated on several threads, and parameters that only the sensors see reuse the
// plant. Steps are damped (Levenberg-Marquardt); an unknown that is pushed against its bound is held there.

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "estimator/effects/effect.hpp"
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
  size_t count = 0;  ///< residuals that are not missing
  size_t iterations = 0;
  size_t simulations = 0;  ///< of whole sessions
  bool converged = false;

  [[nodiscard]] double reduced() const {
    return chi_square / static_cast<double>(count - std::min(values.size(), count - 1));
  }
  /// By name; NaN if there is none.
  [[nodiscard]] double value(std::string_view name) const;
};

/// Whitened residuals, or their means over a tenth of a second, which know no resonances and lead a search from afar.
enum class Look { fine, coarse };

struct RigFitOptions {
  size_t threads = 2;
  size_t most_iterations = 25;
  SimulationOptions simulation{};
};

class RigProblem {
 public:
  /// `session` and `family` must outlive it. The beats' shapes are those of the base model's fit.
  RigProblem(const Session& session, const SpecimenFamily& family, const RigFitOptions& options = {});

  [[nodiscard]] const NoiseModel& noise() const { return noise_; }
  [[nodiscard]] const std::vector<ResidualBlock>& blocks() const { return blocks_; }
  /// The model without effects, fitted; made once.
  [[nodiscard]] const RigFit& base() const { return base_; }
  /// Starts from the base's values and the effects' typical ones, of several sizes and signs the best.
  [[nodiscard]] RigFit fit(const std::vector<Ingredient>& ingredients) const;
  /// The same from given values.
  [[nodiscard]] RigFit fit_from(const std::vector<Ingredient>& ingredients, std::vector<double> values,
                                Look look = Look::fine) const;
  [[nodiscard]] Eigen::VectorXd residuals(const std::vector<Ingredient>& ingredients,
                                          const std::vector<double>& values, Look look = Look::fine) const;
  /// What each run's instruments show by a model.
  [[nodiscard]] std::vector<Prediction> predictions(const std::vector<Ingredient>& ingredients,
                                                    const std::vector<double>& values) const;
  [[nodiscard]] std::vector<Unknown> unknowns(const std::vector<Ingredient>& ingredients) const;
  [[nodiscard]] RigModel model(const std::vector<Ingredient>& ingredients,
                               const std::vector<double>& values) const;

 private:
  /// The plant's traces of all runs.
  [[nodiscard]] std::vector<PlantTrace> plants(const RigModel& model) const;
  [[nodiscard]] Eigen::VectorXd compare(const RigModel& model, const std::vector<PlantTrace>& plants,
                                        Look look) const;
  void add_channel(const SessionRun& run, Channel channel, const std::vector<double>& predicted, size_t first,
                   Look look, Eigen::VectorXd& out) const;
  void shrink_beats(Eigen::VectorXd& residuals) const;
  void set_blocks();
  void set_beats();
  /// Whitened change of each run's channels by the stroke of every second cycle, per relative change.
  [[nodiscard]] std::vector<std::map<Channel, std::vector<double>>> beat_shapes(size_t parity) const;

  const Session& session_;
  const SpecimenFamily& family_;
  RigFitOptions options_;
  NoiseModel noise_;
  std::vector<ResidualBlock> blocks_;
  size_t rows_ = 0;
  size_t missing_ = 0;

  /// A cycle's whitened shape in all channels, of unit length, and how much of it is taken off.
  struct Beat {
    std::vector<CycleRows> rows;
    Eigen::VectorXd direction;
    double taken = 0.0;
  };
  std::vector<Beat> beats_;
  RigFit base_;
};

}  // namespace diastole::rig
