// What an effect of a file costs over the built-in one that it expresses: time to put it into the rig's model, to simulate ten
// cycles and to observe them.
//
//   tools/bench effects

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <vector>

#include "estimator/effects/file_effect.hpp"
#include "estimator/rig/simulation.hpp"

namespace {

using namespace diastole;

/// An incompressible gel's curve, nearly.
class GelCurve final : public rig::SpecimenCurves {
 public:
  GelCurve() {
    std::vector<rig::SpecimenCurve::Point> points;
    for (double volume = -20.0; volume <= 80.0; volume += 4.0)
      points.push_back({volume, 0.02 * volume - 6e-5 * volume * volume, 0.02 - 1.2e-4 * volume});
    curve_ = rig::SpecimenCurve(points);
  }
  [[nodiscard]] const rig::SpecimenCurve& plain() const override { return curve_; }
  [[nodiscard]] bool has_neighbours() const override { return false; }
  [[nodiscard]] rig::SpecimenCurve neighbour(rig::Difference, double, bool) const override { return curve_; }

 private:
  rig::SpecimenCurve curve_;
};

rig::RunDrive ten_cycles() {
  rig::RunDrive run;
  std::vector<rig::Stroke> strokes;
  for (int cycle = 0; cycle < 10; ++cycle) {
    const double start_s = 1.0 + 1.2 * cycle;
    strokes.push_back({start_s, start_s + 0.6, 0.0, 40.0});
    strokes.push_back({start_s + 0.6, start_s + 1.2, 40.0, 0.0});
    run.place.trigger_s.push_back(start_s);
  }
  run.motion = rig::Motion(strokes, 0.0, 0.05);
  run.place.name = "baseline";
  run.end_s = 14.0;
  return run;
}

/// The shortest of several: what is beside costs time too.
double milliseconds(const Effect& effect, const rig::RunDrive& run, const std::vector<double>& sample_s) {
  static const GelCurve family;
  const std::vector<ChangePoint> moments{{"baseline", 5.3, 5.3}};
  std::vector<double> values;
  for (const EffectParameter& parameter : effect.parameters())
    values.push_back(parameter.typical);
  double least = 1e9;
  for (int k = 0; k < 25; ++k) {
    const std::clock_t begun = std::clock();  // of the processor
    rig::RigModel model;
    model.curve = family.plain();
    model.modulus_kPa = 8.0;
    effect.apply(values, {family, moments}, model);
    const auto seen = rig::observe(model, rig::simulate_plant(model, run), run.place, sample_s);
    volatile double sink = seen.cavity_kPa.back();
    (void)sink;
    least = std::min(least, 1e3 * static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC);
  }
  return least;
}

}  // namespace

int main() {
  const rig::RunDrive run = ten_cycles();
  std::vector<double> sample_s;
  for (double time_s = 0.0; time_s < run.end_s; time_s += 1.0 / 300.0)
    sample_s.push_back(time_s);
  fmt::print("{:<24}{:>14}{:>12}{:>8}\n", "effect", "built in, ms", "file, ms", "ratio");
  for (const Effect* effect : rig_effects()) {
    const std::string file =
        fmt::format(DIASTOLE_SOURCE_DIR "/examples/effects/{}.effect.toml", effect->text().id);
    if (!std::filesystem::exists(file)) continue;
    const double built_in = milliseconds(*effect, run, sample_s);
    const double as_file = milliseconds(*read_effect(file), run, sample_s);
    fmt::print("{:<24}{:>14.3f}{:>12.3f}{:>8.2f}\n", effect->text().id, built_in, as_file,
               as_file / built_in);
  }
}
