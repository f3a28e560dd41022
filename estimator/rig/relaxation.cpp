#include "estimator/rig/relaxation.hpp"

#include <cmath>
#include <memory>

namespace diastole::rig {
namespace {

class Relaxation final : public SpecimenMemory {
 public:
  explicit Relaxation(const std::vector<RelaxingPart>& parts) {
    for (const RelaxingPart& part : parts)
      modes_.push_back({.part = part.part, .time_s = part.time_s});
  }
  [[nodiscard]] double look(double elastic_kPa, double, double time_s) const override {
    double pressure = elastic_kPa;
    for (const Mode& mode : modes_)
      pressure -= mode.part * (elastic_kPa - history(mode, elastic_kPa, time_s));
    return pressure;
  }
  void pass(double elastic_kPa, double, double time_s) override {
    for (Mode& mode : modes_)
      mode.history_kPa = history(mode, elastic_kPa, time_s);
    elastic_kPa_ = elastic_kPa;
    time_s_ = time_s;
    begun_ = true;
  }

 private:
  struct Mode {
    double part = 0.0, time_s = 1.0;
    double history_kPa = 0.0;
    mutable double decay_at = 0.0, decay = 1.0, gathered = 1.0;
  };
  /// h_i after a change that is linear in time.
  [[nodiscard]] double history(const Mode& mode, double elastic_kPa, double time_s) const {
    if (!begun_) return elastic_kPa;
    const double x = (time_s - time_s_) / mode.time_s;
    if (x <= 0.0) return mode.history_kPa;
    if (std::abs(x - mode.decay_at) > 1e-9 * x) {  // steps differ by rounding
      mode.decay_at = x;
      mode.decay = std::exp(-x);
      mode.gathered = -std::expm1(-x) / x;
    }
    return mode.decay * mode.history_kPa + (elastic_kPa - elastic_kPa_) * mode.gathered;
  }
  std::vector<Mode> modes_;
  double elastic_kPa_ = 0.0, time_s_ = 0.0;
  bool begun_ = false;
};

}  // namespace

void add_relaxation(RigModel& model, std::vector<RelaxingPart> parts) {
  std::erase_if(parts, [](const RelaxingPart& part) { return part.part == 0.0; });
  if (parts.empty()) return;
  model.memories.emplace_back([=](const RunPlace&) { return std::make_unique<Relaxation>(parts); });
}

}  // namespace diastole::rig
