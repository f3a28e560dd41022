#pragma once
// The loop of `run --shape` on the simulated rig's plant, which shares no code with the model that learns.

#include <gmock/gmock.h>

#include <algorithm>
#include <iostream>
#include <optional>
#include <vector>

#include "estimator/model/specimen_family.hpp"
#include "estimator/rig_fit/simulated_session.hpp"
#include "estimator/shaping/drive_bounds.hpp"
#include "estimator/shaping/learning.hpp"
#include "tests/tools/diastole/plant_for_shape.hpp"

namespace diastole::shaping {

inline constexpr CyclePlan plan{.rest_s = 1.0, .cycles = 12, .settling = 3};
inline constexpr double period_s = 1.2, range_mL = 24.0;

/// Fast filling, slow filling, a plateau and ejection: harmonics that no pump's own waveform has.
inline PeriodicCurve ventricle() {
  std::vector<double> values;
  for (int j = 0; j < 1024; ++j) {
    const double t = j / 1024.0;
    const double fill = 1.0 / (1.0 + std::exp(-(t - 0.22) / 0.045)),
                 kick = std::exp(-std::pow((t - 0.62) / 0.07, 2));
    const double empty = 1.0 / (1.0 + std::exp((t - 0.8) / 0.04));
    values.push_back((fill + 0.12 * kick) * empty);
  }
  PeriodicCurve curve = periodic_curve(values, period_s, 64);
  const double least = curve.at(curve.least_at_s()), scale = range_mL / curve.range();
  curve.c[0] -= least;
  curve.c *= scale;
  return curve;
}

inline DriveModel gel_model() {
  static const auto family =
      std::make_shared<rig::SpecimenFamily>(rig::gel_study(), rig::SpecimenResolution{{4, 4, 1}, {4, 4, 1}});
  rig::RigModel base;
  base.hose.loss_at_cavity = 1.0;
  base.curve = family->plain();
  base.modulus_kPa = 8.8;
  return {base, family, built_in_effects(), learnable_effects(built_in_effects(), base), {}, plan};
}

struct FiveEffects {
  double wave_speed_m_s = 60.0, gas_mL = 8.0, leak_mL_s_kPa = 0.05, backlash_mL = 0.3, gain = -0.06;
};

inline sim_rig::PlantConfig with_effects(const FiveEffects& sizes, uint64_t seed = 1) {
  sim_rig::PlantConfig plant;
  plant.seed = seed;
  plant.hose.wave_speed_m_s = sizes.wave_speed_m_s;
  plant.hose.segments = sim_rig::segments_for(plant.hose);
  plant.flaws.pump.gas_mL = sizes.gas_mL;
  plant.flaws.pump.leak_mL_s_kPa = sizes.leak_mL_s_kPa;
  plant.flaws.drive.backlash_mL = sizes.backlash_mL;
  plant.flaws.drive.gain = sizes.gain;
  return plant;
}

inline const Bound free_pump = [](const PeriodicCurve& drive, const Eigen::MatrixXd&) { return drive; };

inline double true_nrmse(const PlantRun& run, const PeriodicCurve& wanted) {
  PeriodicCurve level = run.true_mL;
  level.c[0] = wanted.c[0];
  return rms_between(level, wanted) / wanted.range();
}

struct Loop {
  std::vector<double> nrmse;  ///< true ones
  std::vector<GatedRun> runs;
  Lesson lesson;
};

/// Up to so many runs, as `run --shape` makes them. `leak_in`: the run, from 1, in the middle of which the cavity begins to leak.
inline Loop learned(PlantForShape& rig, const PeriodicCurve& wanted, size_t iterations,
                    std::optional<double> gated_sd_mL = {}, size_t leak_in = 0) {
  constexpr double middle_s = 9.0;
  const DriveModel model = gel_model();
  const Eigen::Index harmonics = harmonics_needed(wanted, 1e-3, 24);
  const PeriodicCurve first = model.inverse(wanted, wanted.with(harmonics));
  Loop loop;
  loop.lesson = learn(model, wanted, first, {}, free_pump);
  while (loop.runs.size() < iterations && loop.lesson.ending == Ending::none) {
    const bool leaks = loop.runs.size() + 1 == leak_in;
    const PlantRun run =
        rig.play(loop.lesson.drive_mL, gated_sd_mL, leaks ? std::optional(middle_s) : std::nullopt);
    loop.nrmse.push_back(true_nrmse(run, wanted));
    const auto zero_kPa = loop.runs.empty() ? std::nullopt : std::optional(loop.runs.front().zero_kPa);
    loop.runs.push_back(gated_run(run.run, model, period_s, 2 * harmonics, zero_kPa));
    loop.lesson = learn(model, wanted, first, loop.runs, free_pump);
  }
  return loop;
}

inline void expect_followed(const Loop& loop) {
  std::cout << "true NRMSE of each run, %:";
  for (const double nrmse : loop.nrmse)
    std::cout << ' ' << std::round(1e4 * nrmse) / 100.0;
  std::cout << "; " << in_words(loop.lesson.ending) << " " << loop.lesson.reason << '\n';
  ASSERT_GE(loop.nrmse.size(), 2U);
  EXPECT_GT(loop.nrmse.front(), 0.05) << "there is nothing to learn";
  const size_t within = std::min<size_t>(loop.nrmse.size(), 3);
  EXPECT_LE(*std::min_element(loop.nrmse.begin(), loop.nrmse.begin() + static_cast<std::ptrdiff_t>(within)),
            0.01);
  for (const double nrmse : loop.nrmse)
    EXPECT_LE(nrmse, loop.nrmse.front());
  ASSERT_TRUE(loop.lesson.best);
  EXPECT_LE(loop.nrmse[*loop.lesson.best], 0.01);
  for (size_t i = 0; i < loop.nrmse.size(); ++i)  // what it says of itself
    EXPECT_NEAR(loop.lesson.iterations[i].nrmse, loop.nrmse[i], 0.002 + loop.lesson.iterations[i].floor);
}

}  // namespace diastole::shaping
