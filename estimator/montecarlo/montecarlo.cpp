#include "estimator/montecarlo/montecarlo.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimator/fit/estimated_parameters.hpp"
#include "estimator/fit/fit.hpp"
#include "estimator/fit/study_fit.hpp"
#include "estimator/fit/study_motion.hpp"
#include "estimator/fit/unloaded_motion.hpp"
#include "estimator/fit/usable_points.hpp"
#include "estimator/inference/intervals.hpp"
#include "estimator/model/affected_model.hpp"
#include "estimator/model/study_model.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

std::vector<NodeField> true_motions(const Study& study, ElasticMotion& motion,
                                    const EstimatedParameters& estimated, const Measurement& design) {
  const std::vector<double> values = estimated.starts();
  std::vector<NodeField> motions(design.frames.size());
  for (size_t number = 1; number < design.frames.size(); ++number) {
    const double pressure_kPa = design.frames[number].pressure_kPa;
    MotionOutcome outcome = motion.solve(number - 1, values, pressure_kPa);
    if (!outcome.position_mm) {
      throw InputError({study.file.string(), fmt::format("frame {}", number),
                        fmt::format("has no equilibrium at the values to simulate: {}", outcome.reason),
                        "Give other values with --set, or refine the mesh."});
    }
    motions[number] = std::move(*outcome.position_mm);
  }
  return motions;
}

/// A seed of its own for every cell, whatever the plan around it.
std::mt19937_64 generator_of(const Cell& cell, unsigned seed) {
  std::seed_seq sequence{seed, static_cast<unsigned>(std::lround(cell.noise_mm * 1e6)),
                         static_cast<unsigned>(cell.frames), static_cast<unsigned>(cell.repeat)};
  return std::mt19937_64(sequence);
}

ImagedLoad read_with_noise(ImagedLoad load, const NoiseOptions& options, std::mt19937_64& generator) {
  if (options.exact_pressures) return {load.pressure_kPa, 0};
  std::normal_distribution<double> normal;
  load.pressure_kPa += options.share * load.sigma_kPa * normal(generator);
  return load;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values)
    sum += value;
  return sum / static_cast<double>(values.size());
}

bool holds(const StudyParameter& parameter, double value, double se) {
  if (!(parameter.lower > 0)) return std::abs(value - parameter.start) <= inference::normal_95 * se;
  return std::abs(std::log(parameter.start / value)) <= inference::normal_95 * se / value;
}

ParameterSpread spread_of(const StudyParameter& parameter, const std::vector<double>& values,
                          const std::vector<double>& errors) {
  ParameterSpread spread{parameter.name, parameter.start, mean(values), 0, 0, {}, mean(errors), 0, unknown};
  for (size_t i = 0; i < values.size(); ++i) {
    spread.sd += std::pow(values[i] - spread.mean, 2);
    spread.coverage +=
        holds(parameter, values[i], errors[i]) ? 1.0 / static_cast<double>(values.size()) : 0.0;
  }
  spread.sd = std::sqrt(spread.sd / static_cast<double>(values.size() - 1));
  spread.sd_percent = 100 * spread.sd / spread.mean;
  spread.ci95 = {spread.mean - inference::normal_95 * spread.sd,
                 spread.mean + inference::normal_95 * spread.sd};
  return spread;
}

struct PaperRow {
  double noise_mm;
  int frames;
  std::array<double, 4> sd_percent;
};

constexpr std::array<PaperRow, 12> papers_table{{{0.4, 1, {5, 4, 3, 4}},
                                                 {0.4, 3, {1, 1, 1, 1}},
                                                 {0.4, 5, {1, 1, 1, 1}},
                                                 {0.8, 1, {10, 7, 7, 13}},
                                                 {0.8, 3, {1, 2, 1, 2}},
                                                 {0.8, 5, {2, 2, 2, 3}},
                                                 {1.6, 1, {21, 16, 13, 22}},
                                                 {1.6, 3, {4, 4, 7, 5}},
                                                 {1.6, 5, {6, 4, 6, 8}},
                                                 {3.2, 1, {57, 28, 20, 43}},
                                                 {3.2, 3, {15, 12, 14, 20}},
                                                 {3.2, 5, {6, 5, 9, 9}}}};

}  // namespace

std::vector<Cell> cells_of(const MonteCarloPlan& plan) {
  std::vector<Cell> cells;
  for (int repeat = 0; repeat <= plan.repeats; ++repeat) {
    for (const double noise_mm : plan.noise_mm) {
      for (const int frames : plan.frames)
        cells.push_back({noise_mm, frames, repeat});
    }
  }
  return cells;
}

struct CellFitter::Impl {
  MonteCarloPlan plan;
  EstimatedParameters estimated;
  std::unique_ptr<ElasticMotion> motion;
  std::optional<ImagedLoad> imaged;  ///< the true one, if there is one
  FitOptions options;
  Measurement exact;
};

CellFitter::CellFitter(const Study& study, const Measurement& measured, const MonteCarloPlan& plan) {
  ElasticModel model = make_affected_model(study);
  const Measurement design = plan.grid ? imaged_design(model.mesh(), *plan.grid, measured.frames) : measured;
  require_loaded_points(study, design);
  for (const int frames : plan.frames)
    (void)spread_frames(design, frames);
  require_cavity(study, model);
  EstimatedParameters estimated = estimated_parameters(study, model);
  std::unique_ptr<ElasticMotion> motion =
      study_motion(study, std::move(model), estimated.groups, plan.unload);
  const std::optional<ImagedLoad> imaged = motion->imaged_load();
  const LocatorOptions locator = locator_for(study.specimen);
  Measurement exact =
      exact_measurement(motion->mesh(), design, true_motions(study, *motion, estimated, design), locator);
  require_half_usable({loaded_points(exact), loaded_points(design)}, study.file.string());
  FitOptions options;
  options.file = study.file.string();
  options.locator = locator;
  options.smooth = estimated.smooth;
  options.robustness = Robustness::never;
  impl_ = std::make_unique<Impl>(
      Impl{plan, std::move(estimated), std::move(motion), imaged, std::move(options), std::move(exact)});
}

CellFitter::~CellFitter() = default;

size_t CellFitter::points() const { return impl_->exact.tags.size() + impl_->exact.points.size(); }

CellResult CellFitter::fit(const Cell& cell) {
  std::mt19937_64 generator = generator_of(cell, impl_->plan.seed);
  const std::vector<int> frames = spread_frames(impl_->exact, cell.frames);
  const NoiseOptions noise{cell.noise_mm, impl_->plan.exact_pressures, cell.repeat == 0 ? 0.0 : 1.0};
  const Measurement measurement = with_noise(impl_->exact, frames, noise, generator);
  if (auto* unloaded = dynamic_cast<UnloadedMotion*>(impl_->motion.get()))
    unloaded->set_imaged_load(read_with_noise(impl_->imaged.value(), noise, generator));
  const FitOutcome outcome = fit_motion(*impl_->motion, impl_->estimated.values, measurement, impl_->options);
  CellResult result{
      cell, outcome.converged() && !outcome.values.empty(), outcome.iterations, outcome.seconds, {}, {}};
  if (!result.converged) return result;
  for (const ParameterRun& run : impl_->estimated.runs) {
    double sum = 0;
    for (size_t i = run.first; i < run.first + run.count; ++i)
      sum += outcome.values[i].value;
    result.value.push_back(sum / static_cast<double>(run.count));
    result.se.push_back(run.se_of_mean(outcome.covariance));
  }
  return result;
}

std::vector<TableEntry> table_of(const MonteCarloPlan& plan, const Study& study,
                                 const std::vector<CellResult>& results) {
  std::vector<TableEntry> table;
  for (const double noise_mm : plan.noise_mm) {
    for (const int frames : plan.frames) {
      TableEntry entry{noise_mm, frames, 0, 0, {}};
      std::vector<std::vector<double>> values(study.law.parameters.size()), errors = values;
      std::vector<double> bounds;
      for (const CellResult& result : results) {
        if (result.cell.noise_mm != noise_mm || result.cell.frames != frames ||
            result.cell.repeat > plan.repeats)
          continue;
        if (result.cell.repeat == 0) {
          bounds = result.se;
          continue;
        }
        ++(result.converged ? entry.refits : entry.failed);
        for (size_t i = 0; result.converged && i < values.size(); ++i) {
          values[i].push_back(result.value[i]);
          errors[i].push_back(result.se[i]);
        }
      }
      if (entry.refits > 1) {
        for (size_t i = 0; i < values.size(); ++i) {
          entry.parameters.push_back(spread_of(study.law.parameters[i], values[i], errors[i]));
          if (!bounds.empty()) entry.parameters.back().bound = bounds[i];
        }
      }
      table.push_back(std::move(entry));
    }
  }
  return table;
}

std::optional<std::array<double, 4>> paper_sd_percent(double noise_mm, int frames) {
  const auto found = std::find_if(papers_table.begin(), papers_table.end(), [&](const PaperRow& row) {
    return std::abs(row.noise_mm - noise_mm) < 1e-9 && row.frames == frames;
  });
  if (found == papers_table.end()) return {};
  return found->sd_percent;
}

}  // namespace diastole
