// The specimen relaxes.

#include <array>
#include <cmath>
#include <memory>

#include "estimator/effects/effect.hpp"

namespace diastole {
namespace {

class Relaxation final : public rig::SpecimenMemory {
 public:
  Relaxation(const std::array<double, 3>& parts, const std::array<double, 3>& times) {
    for (size_t i = 0; i < parts.size(); ++i)
      if (parts[i] != 0.0) modes_[count_++] = {.part = parts[i], .time_s = times[i]};
  }
  [[nodiscard]] double look(double elastic_kPa, double, double time_s) const override {
    double pressure = elastic_kPa;
    for (size_t i = 0; i < count_; ++i)
      pressure -= modes_[i].part * (elastic_kPa - history(modes_[i], elastic_kPa, time_s));
    return pressure;
  }
  void pass(double elastic_kPa, double, double time_s) override {
    for (size_t i = 0; i < count_; ++i)
      modes_[i].history_kPa = history(modes_[i], elastic_kPa, time_s);
    elastic_kPa_ = elastic_kPa;
    time_s_ = time_s;
    begun_ = true;
  }

 private:
  struct Mode {
    double part = 0.0, time_s = 1.0;
    double history_kPa = 0.0;
    mutable double decay_at = 0.0, decay = 1.0;
  };
  /// h_i after a change that is linear in time.
  [[nodiscard]] double history(const Mode& mode, double elastic_kPa, double time_s) const {
    if (!begun_) return elastic_kPa;
    const double x = (time_s - time_s_) / mode.time_s;
    if (x <= 0.0) return mode.history_kPa;
    if (std::abs(x - mode.decay_at) > 1e-9 * x) {  // steps differ by rounding
      mode.decay_at = x;
      mode.decay = std::exp(-x);
    }
    return mode.decay * mode.history_kPa + (elastic_kPa - elastic_kPa_) * (1.0 - mode.decay) / x;
  }
  std::array<Mode, 3> modes_{};
  size_t count_ = 0;
  double elastic_kPa_ = 0.0, time_s_ = 0.0;
  bool begun_ = false;
};

}  // namespace

Effect viscoelasticity_effect() {
  return {{
      .id = "viscoelasticity",
      .title = "viscoelastic specimen",
      .port = Port::specimen,
      .equations = "p = p_e - sum g_i (p_e - h_i), h_i the history of p_e fading with tau_i: dh_i/dt = "
                   "dp_e/dt - h_i / tau_i. C1 is the instantaneous modulus.",
      .source = "Y. C. Fung, Biomechanics (1993): quasi-linear viscoelasticity with three exponentials.",
      .looks_like = "Pressures lead volumes; after a ramp they relax; stiffness grows with rate.",
      .revealed_by = "A hold after a quick ramp and the same stroke at several rates.",
      .conflicts = {"cannula-leak-cavity", "seal-leak-pump"},
      .parameters = {{"g_fast", "", "part that relaxes within tau_fast", 0.0, 0.0, 0.6, 0.08},
                     {"g_middle", "", "within tau_middle", 0.0, 0.0, 0.6, 0.03},
                     {"g_slow", "", "within tau_slow", 0.0, 0.0, 0.6, 0.04},
                     {"tau_fast_s", "s", "", 0.1, 0.02, 0.4, 0.1, SearchScale::logarithmic},
                     {"tau_middle_s", "s", "", 1.0, 0.4, 2.5, 1.0, SearchScale::logarithmic},
                     {"tau_slow_s", "s", "", 6.0, 2.5, 60.0, 6.0, SearchScale::logarithmic}},
      .keeps_modulus = false,
      .apply =
          [](EffectValues values, const EffectContext&, rig::RigModel& model) {
            std::array<double, 3> parts{values[0], values[1], values[2]};
            std::array<double, 3> times{values[3], values[4], values[5]};
            if (parts == std::array<double, 3>{}) return;
            model.memories.emplace_back(
                [=](const rig::RunPlace&) { return std::make_unique<Relaxation>(parts, times); });
          },
  }};
}

}  // namespace diastole
