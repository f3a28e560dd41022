#pragma once
// A measured flow with its loop and images: what `diastole flow --page` shows and `diastole report` reads again
// (JSON, format "diastole-flow").

#include <string>
#include <string_view>
#include <vector>

#include "estimator/io/finding.hpp"

namespace diastole {

inline constexpr std::string_view flow_record_mark = "diastole-flow";

struct FlowPhaseRecord {
  double phase_s = 0;
  double flow_mL_s = 0, flow_sigma_mL_s = 0;
  double volume_mL = 0, volume_sigma_mL = 0;
  double core_cm_s = 0;  ///< the fastest fluid
  int turns = 0;         ///< put back to it
};

/// A window of the slice around the lumen. Places are in pixels from the window's first pixel's centre: column, row.
struct FlowImageRecord {
  double phase_s = 0;
  std::string magnitude;        ///< 8 bits a pixel, row by row, base64
  std::string velocity;         ///< the same; 0 is -venc, 255 is +venc
  std::vector<double> outline;  ///< two numbers each: column, row
};

struct LoopPointRecord {
  double phase_s = 0;
  double volume_mL = 0, volume_sigma_mL = 0;
  double pressure_kPa = 0, pressure_sigma_kPa = 0;
  double stiffness_kPa_per_mL = 0, stiffness_sigma_kPa_per_mL = 0;  ///< NaN where the flow turns
};

struct FlowRecord {
  std::string folder, series;
  double venc_cm_s = 0;
  std::string venc_source;
  double interval_s = 0;
  double stroke_mL = 0, stroke_sigma_mL = 0;
  double closure_mL = 0, closure_sigma_mL = 0;
  bool is_closed = false;
  int background_order = -1;                              ///< -1: not known
  double background_cm_s = 0, background_sigma_cm_s = 0;  ///< at the lumen: taken off, and its error
  size_t unwrapped = 0;
  double area_mm2 = 0, movement_mm = 0;
  double reduced_chi_square = 0;
  std::vector<FlowPhaseRecord> phases;
  std::vector<double> time_s, flow_mL_s, flow_sigma_mL_s, volume_mL,
      volume_sigma_mL;          ///< the whole cycle, evenly
  std::string pressure_source;  ///< empty: no loop
  double work_mJ = 0, work_sigma_mJ = 0;
  std::vector<LoopPointRecord> loop;
  int rows = 0, columns = 0;  ///< of the window
  std::vector<FlowImageRecord> images;
  std::vector<Finding> findings;
};

std::string to_json(const FlowRecord& record);
/// Whether text is such a record, by its format.
bool is_flow(std::string_view text);
/// Throws InputError (file, problem, remedy) unless it is a whole one.
FlowRecord flow_record_from_json(std::string_view text, const std::string& file);

}  // namespace diastole
