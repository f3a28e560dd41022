#pragma once
// A run as BIDS physiological recording: NAME_physio.tsv.gz, a table without header, and NAME_physio.json, which says
// what its columns are (BIDS specification, "Physiological recordings").
//
// Row k is sample k, at StartTime + k / SamplingFrequency; StartTime counts from the run's first trigger, with which
// imaging begins, and so is negative. Columns: every pressure channel, commanded_mL (the commanded volume at the
// sample's time, straight between two positions), trigger (1 in the row nearest to a rising edge, else 0). A value
// that is missing is "n/a".

#include <nlohmann/json.hpp>
#include <string>

#include "protocol/runfile/run.hpp"

namespace diastole {

struct BidsRecording {
  nlohmann::ordered_json description;
  std::string table;  ///< tab-separated
};

/// Precondition: the run holds at least two pressure rows.
BidsRecording bids_recording(const runfile::RecordedRun& run);

/// The bytes of a gzip file with this content, always the same.
std::string gzip(const std::string& content);

}  // namespace diastole
