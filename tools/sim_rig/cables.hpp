#pragma once
// The cables that lead away from the controller, and what may be wrong with them.

#include "tools/sim_controller/pty_line.hpp"

namespace diastole::sim_rig {

struct Cables {
  explicit Cables(const std::filesystem::path& link) : line(link) {}

  sim_controller::PtyLine line;  ///< to the host
  bool to_host = true;           ///< whether what the controller sends gets through
  bool from_host = true;         ///< and what the host sends
  bool to_scanner = true;        ///< TTL and R-wave
};

}  // namespace diastole::sim_rig
