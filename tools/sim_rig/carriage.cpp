#include "tools/sim_rig/carriage.hpp"

namespace diastole::sim_rig {

std::optional<double> Carriage::take(const PinEdge& edge) {
  if (edge.pin == Pin::dir) inflate_ = edge.value != 0;
  if (edge.pin != Pin::step || edge.value == 0) return std::nullopt;
  position_ += inflate_ ? 1 : -1;
  if (vented_) {
    if (was_on_switch_ && !home_switch_closed()) vented_ = false;
    was_on_switch_ = home_switch_closed();
  }
  if (vented_) return std::nullopt;
  return static_cast<double>(position_) * microstep_mL_;
}

}  // namespace diastole::sim_rig
