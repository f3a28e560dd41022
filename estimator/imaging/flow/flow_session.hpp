#pragma once
// All that `diastole flow` does, from a folder and a run to flow, volume and loop.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "estimator/imaging/flow/pressure_volume_loop.hpp"
#include "estimator/io/flow_file.hpp"

namespace diastole::imaging {

struct FlowSessionRequest {
  std::filesystem::path folder;
  PhaseContrastRequest scan = {};
  FlowRequest flow = {};
  std::optional<std::filesystem::path> run = {};                     ///< whose pressure gives the loop
  std::optional<std::filesystem::path> pressure = {}, trigger = {};  ///< the same from two tables
  std::optional<size_t> segment = {};
};

struct FlowSession {
  std::string folder;
  FlowMeasurement flow;
  std::optional<PressureVolumeLoop> loop;
  std::vector<Finding> findings;  ///< of folder and flow
};

using Stage = std::function<void(const std::string& stage)>;

/// Throws InputError for a folder that is not sound, or as phase_contrast, measure_flow and pressure_volume_loop do. Writes nothing.
FlowSession measure_session(const FlowSessionRequest& request, const Stage& stage = {});

/// Writes the volume, counted from the segment's offset, to the run that the loop's pressure came from. Throws InputError as runfile::store_flow does.
void store_in_run(const FlowSession& session, const std::filesystem::path& run, bool replace);

FlowRecord flow_record(const FlowSession& session);

}  // namespace diastole::imaging
