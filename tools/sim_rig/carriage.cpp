#include "tools/sim_rig/carriage.hpp"

namespace diastole::sim_rig {

std::optional<double> Carriage::take(const sim_controller::PinEdge& edge, double piston_kPa) {
  if (edge.pin == sim_controller::Pin::dir) inflate_ = edge.value != 0;
  if (edge.pin != sim_controller::Pin::step || edge.value == 0) return std::nullopt;
  if (!slip_.follows(inflate_, piston_kPa)) return std::nullopt;
  position_ += inflate_ ? 1 : -1;
  was_on_switch_ = was_on_switch_ || position_ <= 0;
  if (was_on_switch_ && position_ >= home_) vented_ = false;
  if (vented_) return std::nullopt;
  return static_cast<double>(position_ - home_) * microstep_mL_;
}

}  // namespace diastole::sim_rig
