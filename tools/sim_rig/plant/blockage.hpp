#pragma once
// A hose that is kinked or clamped at the cannula so that a share f of its area is left: the jet behind it loses its
// speed, K = (1/f - 1)^2 on the dynamic pressure of the open bore (Borda and Carnot).

namespace diastole::sim_rig {

struct Blockage {
  double open_share = 1;  ///< > 0

  [[nodiscard]] double loss_K() const {
    const double jet = 1 / open_share - 1;
    return jet * jet;
  }
};

}  // namespace diastole::sim_rig
