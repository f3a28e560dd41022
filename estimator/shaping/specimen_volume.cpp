#include "estimator/shaping/specimen_volume.hpp"

#include <cmath>
#include <memory>

namespace diastole::shaping {
namespace {

/// One specimen through one run.
class Specimen {
 public:
  explicit Specimen(const DriveModel& of) : model_(of.model()) {
    for (const rig::MemoryMaker& make : model_.memories)
      memories_.push_back(make(of.place()));
  }
  [[nodiscard]] double pressure_kPa(double volume_mL, double time_s) const {
    double pressure = model_.modulus_kPa * model_.curve.at(volume_mL).pressure_kPa;
    for (const auto& memory : memories_)
      pressure = memory->look(pressure, volume_mL, time_s);
    return pressure;
  }
  void pass(double volume_mL, double time_s) {
    double pressure = model_.modulus_kPa * model_.curve.at(volume_mL).pressure_kPa;
    for (const auto& memory : memories_) {
      const double given = pressure;
      pressure = memory->look(given, volume_mL, time_s);
      memory->pass(given, volume_mL, time_s);
    }
  }
  /// By secants from a volume nearby.
  [[nodiscard]] double volume_mL(double pressure, double time_s, double near_mL) const {
    constexpr double small_mL = 0.01, close_kPa = 1e-9;
    double a = near_mL, at_a = pressure_kPa(a, time_s) - pressure;
    double b = near_mL + small_mL;
    for (int step = 0; step < 30; ++step) {
      const double at_b = pressure_kPa(b, time_s) - pressure;
      if (std::abs(at_b) < close_kPa || at_b == at_a) break;
      const double next = b - at_b * (b - a) / (at_b - at_a);
      a = b;
      at_a = at_b;
      b = next;
    }
    return b;
  }

 private:
  const rig::RigModel& model_;
  std::vector<std::unique_ptr<rig::SpecimenMemory>> memories_;
};

}  // namespace

PeriodicCurve specimen_volume(const DriveModel& of, const PeriodicCurve& cavity_kPa, Eigen::Index harmonics) {
  const std::vector<double> pressure = cavity_kPa.at_even(static_cast<size_t>(8 * harmonics + 8));
  const auto count = static_cast<double>(pressure.size());
  const CyclePlan& plan = of.plan();
  std::vector<double> mean_mL(pressure.size(), 0.0);
  Specimen specimen(of);
  specimen.pass(0.0, 0.0);
  double volume_mL = 0.0;
  for (size_t cycle = 0; cycle < plan.cycles; ++cycle) {
    for (size_t j = 0; j < pressure.size(); ++j) {
      const double time_s =
          plan.rest_s + cavity_kPa.period_s * (static_cast<double>(cycle) + static_cast<double>(j) / count);
      volume_mL = specimen.volume_mL(pressure[j], time_s, volume_mL);
      specimen.pass(volume_mL, time_s);
      if (cycle >= plan.settling) mean_mL[j] += volume_mL / static_cast<double>(plan.cycles - plan.settling);
    }
  }
  return periodic_curve(mean_mL, cavity_kPa.period_s, harmonics);
}

}  // namespace diastole::shaping
