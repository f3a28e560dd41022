// The specimen's modulus changes through the session.

#include <cmath>
#include <memory>

#include "estimator/effects/effect.hpp"

namespace diastole {
namespace {

class Warming final : public rig::SpecimenMemory {
 public:
  Warming(double fraction, double tau_s, double started_s)
      : fraction_(fraction), tau_s_(tau_s), started_s_(started_s) {}
  [[nodiscard]] double look(double elastic_kPa, double, double time_s) const override {
    return elastic_kPa * (1.0 - fraction_ * std::expm1(-(started_s_ + time_s) / tau_s_));
  }
  void pass(double, double, double) override {}

 private:
  double fraction_, tau_s_, started_s_;
};

}  // namespace

Effect temperature_drift_effect() {
  return {{
      .id = "temperature-drift",
      .title = "modulus drifting with temperature",
      .port = Port::specimen,
      .equations = "C1(t) = C1 (1 + fraction (1 - exp(-t / tau))), t since the session's first run began.",
      .source = "Rubber elasticity is proportional to temperature; warming of first order.",
      .looks_like = "All pressures scale slowly with the session's time, whichever run.",
      .revealed_by =
          "The same stroke at the session's beginning and end; a rest tells it from a sensor's drift.",
      .conflicts = {"sensor-drift", "stress-softening"},
      .parameters = {{"fraction", "", "final change of the modulus", 0.0, -0.3, 0.3, 0.03},
                     {"tau_s", "s", "of the warming", 300.0, 20.0, 5000.0, 200.0, SearchScale::logarithmic}},
      .keeps_modulus = false,
      .apply =
          [](EffectValues values, const EffectContext&, rig::RigModel& model) {
            const double fraction = values[0];
            const double tau_s = values[1];
            if (fraction == 0.0) return;
            model.memories.emplace_back([=](const rig::RunPlace& place) {
              return std::make_unique<Warming>(fraction, tau_s, place.started_s);
            });
          },
  }};
}

}  // namespace diastole
