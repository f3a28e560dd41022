#include "estimator/imaging/geometry/ventricle_files.hpp"

#include <fmt/format.h>

namespace diastole::imaging {

std::string surface_file_text(const VentricleSession& session) {
  std::string text = std::string(surface_file_mark) + "\n";
  for (const VentriclePhase& phase : session.phases) {
    for (const bool outer : {false, true}) {
      for (const Eigen::Vector3d& x : outer ? phase.outer : phase.inner)
        text += fmt::format("{},{},{:.3f},{:.3f},{:.3f}\n", phase.phase, outer ? "epi" : "endo", x.x(), x.y(),
                            x.z());
    }
  }
  return text;
}

std::string volume_file_text(const VentricleSession& session) {
  std::string text = std::string(volume_file_mark) + "\n";
  for (const VentriclePhase& phase : session.phases)
    text += fmt::format("{},{:.4f},{:.4f},{:.4f},{:.4f}\n", phase.phase, phase.mesh.cavity_mL,
                        phase.cavity_sigma_mL, phase.mesh.wall_mL, phase.mean_thickness_mm);
  return text;
}

}  // namespace diastole::imaging
