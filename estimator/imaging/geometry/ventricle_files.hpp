#pragma once
// The tables that `diastole lv` writes.
//
//   surfaces  phase,surface,x_mm,y_mm,z_mm              surface endo or epi, patient coordinates, up to the base plane
//   volumes   phase,cavity_volume_mL,cavity_sigma_mL,wall_volume_mL,wall_thickness_mm

#include <string>
#include <string_view>

#include "estimator/imaging/geometry/ventricle_session.hpp"

namespace diastole::imaging {

inline constexpr std::string_view surface_file_mark = "phase,surface,x_mm,y_mm,z_mm";
inline constexpr std::string_view volume_file_mark =
    "phase,cavity_volume_mL,cavity_sigma_mL,wall_volume_mL,wall_thickness_mm";

std::string surface_file_text(const VentricleSession& session);
std::string volume_file_text(const VentricleSession& session);

}  // namespace diastole::imaging
