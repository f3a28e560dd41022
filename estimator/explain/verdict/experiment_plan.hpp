#pragma once
// Experiments that a rig can run: segments within its limits, and their file (docs/experiments: format
// "diastole-experiment", version 1).

#include <string>
#include <string_view>
#include <vector>

#include "protocol/runfile/run.hpp"

namespace diastole::explain {

/// What the controller refuses beyond, and what this specimen has borne.
struct ExperimentLimits {
  double flow_mL_s = 1860.0;
  double acceleration_mL_s2 = 1700.0;
  double pressure_kPa = 79.3;  ///< at the piston, from accelerating the fluid in the hose
  double inertance = 0.0;      ///< of that fluid, kPa s^2/mL
  double largest_mL = 40.0;    ///< the largest volume in the session's runs

  /// With a tenth to spare.
  [[nodiscard]] bool allow(const runfile::Segment& segment) const;
};

struct PlannedExperiment {
  std::vector<runfile::Segment> segments;  ///< start_s is not used
  bool new_pump_sensor = false;            ///< asks for a transducer at the pump end that the session lacked
  bool volumes = false;                    ///< phase contrast beside it: every second cycle is imaged
  bool radius = false;                     ///< measured in an image of the specimen at rest
  bool stiffness = false;                  ///< C1 measured by a shear test
};

/// Large and small, fast and slow strokes of the named waveforms, preloads and holds, as many as the limits allow; some
/// fifteen seconds each.
std::vector<runfile::Segment> possible_segments(const ExperimentLimits& limits);

/// "parabolic strokes of 40 mL in 0.8 s", "a hold at 30 mL for 20 s".
std::string words_of(const runfile::Segment& segment);

/// What the file's comments ask a person for besides strokes.
inline constexpr std::string_view ask_for_pump_sensor =
    "# Connect a pressure transducer at the pump end of the hose and name its input in the rig file:\n"
    "# [[daq.channel]] name = \"pump\".\n";
inline constexpr std::string_view ask_for_volumes =
    "# Image the cavity with gated phase contrast meanwhile: 256 lines, one every second cycle.\n";
inline constexpr std::string_view ask_for_radius =
    "# Image the specimen at rest and give its inner radius to the study: specimen.inner_radius_mm.\n";
inline constexpr std::string_view ask_for_stiffness =
    "# Measure C1 by a rotational shear test and bound it in the study, 1.7 standard errors to either side: "
    "law.parameters.C1_kPa.bounds.\n";

/// The file, with `remark` as its first comment.
std::string to_toml(const PlannedExperiment& experiment, const std::string& remark);

}  // namespace diastole::explain
