#pragma once
// A material law fitted to bench tests by least squares, all tests together.
//
// What was set is taken for exact. Errors of what was measured are taken for independent and as large, in each column, as the
// same unknown part of that column's RMS; that part is what the residuals show. So a tube's pressure in kPa and a moment in N mm
// count alike, and intervals are Student's t with readings - parameters degrees of freedom.

#include <Eigen/Core>
#include <array>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "estimator/inference/parameter_space.hpp"
#include "estimator/law_fit/bench_test.hpp"

namespace diastole {

struct LawParameterEstimate {
  std::string name;
  double value = 0;
  double se = 0;                 ///< infinite if it is not determined, 0 on a bound
  std::array<double, 2> ci95{};  ///< as far as the law allows
  inference::BoundSide bound = inference::BoundSide::none;
};

/// Parameters that can be changed together by so many percent of their values without a change that the data would show.
struct Undetermined {
  std::vector<std::pair<std::string, double>> change_percent;  ///< the largest is 1
  double sd_percent = 0;  ///< of that one; infinite if nothing measured depends on it
};

/// One measured column of one test.
struct ChannelFit {
  size_t test = 0, channel = 0;  ///< indices
  double rms = 0;                ///< of the residuals, in the column's unit
  double r2 = 0;                 ///< 1 - SSE / sum of squares about the mean
  std::vector<double> predicted;
};

struct LawFit {
  const Law* law = nullptr;
  bool settled = false;          ///< the search ended where it was to end
  std::string reason;            ///< a sentence
  int starts = 0, agreeing = 0;  ///< searches, and those that ended at this cost
  std::vector<LawParameterEstimate> parameters;
  Eigen::MatrixXd correlation;
  double error_percent = 0;  ///< of what was measured: RMS of residuals over their columns' RMS
  double dof = 0;
  std::vector<Undetermined> undetermined;
  std::vector<ChannelFit> channels;
  std::vector<std::string> remarks;

  [[nodiscard]] bool determined() const { return settled && undetermined.empty(); }
  [[nodiscard]] std::vector<double> values() const;
};

struct LawFitOptions {
  std::function<bool()> interrupted = {};  ///< asked at each step
};

/// Precondition: `check_law` has passed.
LawFit fit_law(const Law& law, std::span<const BenchTest> tests, const LawFitOptions& options = {});

/// Throws InputError if the law has directions that a test does not determine, or more parameters than there are readings.
void check_law(const Law& law, std::span<const BenchTest> tests);
/// The same as a sentence; empty if it can be fitted.
std::string why_not(const Law& law, std::span<const BenchTest> tests);

/// Residuals over the RMS of their columns, in the order of tests, readings and channels; empty without a solution.
Eigen::VectorXd relative_residuals(const Law& law, std::span<const double> values,
                                   std::span<const BenchTest> tests);

}  // namespace diastole
