// The instrument's clock runs fast or slow.

#include <array>

#include "estimator/effects/effect.hpp"

namespace diastole {
namespace {

class ClockSkew final : public Effect {
 public:
  [[nodiscard]] const EffectText& text() const override {
    static const EffectText text{
        .id = "clock-skew",
        .title = "skew of the clocks",
        .port = Port::clock,
        .equations = "y(t) shows what was there at t (1 + ppm 1e-6); t from the run's start.",
        .source = "Crystals differ by tens of ppm.",
        .looks_like = "A lag that grows through each run.",
        .revealed_by = "Long runs of fast cycles.",
        .conflicts = {"trigger-delay"},
        .synergies = {},
    };
    return text;
  }
  [[nodiscard]] std::span<const EffectParameter> parameters() const override {
    static constexpr std::array<EffectParameter, 1> list{
        {{"ppm", "ppm", "by which the instrument counts too few seconds", 0.0, -2000.0, 2000.0, 200.0}}};
    return list;
  }
  [[nodiscard]] Stage stage() const override { return Stage::sensors; }
  void apply(std::span<const double> values, const Context&, rig::RigModel& model) const override {
    model.sample_skew -= 1e-6 * values[0];
  }
};

}  // namespace

const Effect& clock_skew_effect() {
  static const ClockSkew effect;
  return effect;
}

}  // namespace diastole
