#pragma once
// The tables that `diastole flow` writes.
//
//   NAME.flow.csv  phase_s,flow_mL_s,flow_sigma_mL_s,volume_mL,volume_sigma_mL        one row an image phase
//   NAME.loop.csv  phase_s,volume_mL,volume_sigma_mL,pressure_kPa,pressure_sigma_kPa,
//                  stiffness_kPa_per_mL,stiffness_sigma_kPa_per_mL                     in the order of time; empty where the flow turns

#include <string>
#include <string_view>

#include "estimator/imaging/flow/pressure_volume_loop.hpp"

namespace diastole::imaging {

inline constexpr std::string_view flow_file_mark =
    "phase_s,flow_mL_s,flow_sigma_mL_s,volume_mL,volume_sigma_mL";
inline constexpr std::string_view loop_file_mark =
    "phase_s,volume_mL,volume_sigma_mL,pressure_kPa,pressure_sigma_kPa,stiffness_kPa_per_mL,stiffness_sigma_"
    "kPa_per_mL";

std::string flow_file_text(const FlowMeasurement& flow);
std::string loop_file_text(const PressureVolumeLoop& loop);

}  // namespace diastole::imaging
