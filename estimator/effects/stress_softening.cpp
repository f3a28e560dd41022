// The specimen is stiffer until it has been stretched a few times (Mullins).

#include <algorithm>
#include <cmath>
#include <memory>

#include "estimator/effects/effect.hpp"

namespace diastole {
namespace {

class Softening final : public rig::SpecimenMemory {
 public:
  Softening(double delta, double cycles, double scale_mL, const rig::RunPlace& place)
      : delta_(delta),
        cycles_(cycles),
        scale_mL_(scale_mL),
        place_(place),
        largest_mL_(place.largest_before_mL),
        count_(place.cycles_before),
        lost_(-std::expm1(-count_ / cycles_) * final_part(largest_mL_)) {}
  [[nodiscard]] double look(double elastic_kPa, double volume_mL, double time_s) const override {
    return elastic_kPa * (1.0 - delta_ * lost(volume_mL, done(time_s)));
  }
  void pass(double, double volume_mL, double time_s) override {
    const double count = done(time_s);
    lost_ = lost(volume_mL, count);
    count_ = count;
    largest_mL_ = std::max(largest_mL_, volume_mL);
  }

 private:
  [[nodiscard]] double final_part(double largest_mL) const { return -std::expm1(-largest_mL / scale_mL_); }
  [[nodiscard]] double lost(double volume_mL, double count) const {
    return lost_ -
           std::expm1((count_ - count) / cycles_) * (final_part(std::max(largest_mL_, volume_mL)) - lost_);
  }
  [[nodiscard]] double done(double time_s) const { return rig::cycle_at(place_, time_s).done; }
  double delta_, cycles_, scale_mL_;
  rig::RunPlace place_;
  double largest_mL_;
  double count_;  ///< cycles done
  double lost_;   ///< D
};

}  // namespace

Effect stress_softening_effect() {
  return {{
      .id = "stress-softening",
      .title = "stress softening",
      .port = Port::specimen,
      .equations = "p = p_e(V) (1 - delta D), dD/dn = (1 - exp(-V_max / V0_mL) - D) / cycles: n cycles done, "
                   "V_max the largest volume so far; it stays for the session's later runs.",
      .source = "L. Mullins, Rubber Chem. Technol. 42 (1969) 339; the softening of a cyclic test in two "
                "exponentials.",
      .looks_like = "The first cycles of the session's first run have higher pressures; after them nothing "
                    "changes any more.",
      .revealed_by = "A session that begins with many equal strokes; rests do not bring it back.",
      .conflicts = {"temperature-drift", "viscoelasticity"},
      .parameters = {{"delta", "", "final part of the stiffness that is lost", 0.0, 0.0, 0.6, 0.1},
                     {"cycles", "", "in which it is lost", 2.0, 0.3, 20.0, 2.0, SearchScale::logarithmic},
                     {"V0_mL", "mL", "volume at which most of it is lost", 12.0, 1.0, 60.0, 12.0,
                      SearchScale::logarithmic}},
      .keeps_modulus = false,
      .apply =
          [](EffectValues values, const EffectContext&, rig::RigModel& model) {
            const double delta = values[0];
            const double cycles = values[1];
            const double scale_mL = values[2];
            if (delta == 0.0) return;
            model.memories.emplace_back([=](const rig::RunPlace& place) {
              return std::make_unique<Softening>(delta, cycles, scale_mL, place);
            });
          },
  }};
}

}  // namespace diastole
