#include "estimator/imaging/flow/flow_files.hpp"

#include <fmt/format.h>

namespace diastole::imaging {

std::string flow_file_text(const FlowMeasurement& flow) {
  std::string text = std::string(flow_file_mark) + "\n";
  for (const PhaseFlow& phase : flow.phases)
    text += fmt::format("{:.6f},{:.6f},{:.6f},{:.6f},{:.6f}\n", phase.phase_s, phase.flow_mL_s.value,
                        phase.flow_mL_s.sigma, phase.volume_mL.value, phase.volume_mL.sigma);
  return text;
}

std::string loop_file_text(const PressureVolumeLoop& loop) {
  std::string text = std::string(loop_file_mark) + "\n";
  for (const LoopPoint& point : loop.points) {
    text += fmt::format("{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},", point.phase_s, point.volume_mL.value,
                        point.volume_mL.sigma, point.pressure_kPa.value, point.pressure_kPa.sigma);
    text += point.stiffness_kPa_per_mL ? fmt::format("{:.7f},{:.7f}\n", point.stiffness_kPa_per_mL->value,
                                                     point.stiffness_kPa_per_mL->sigma)
                                       : std::string(",\n");
  }
  return text;
}

}  // namespace diastole::imaging
