#pragma once
// A run as BIDS physiological recording: NAME_physio.tsv.gz, a table without header, and NAME_physio.json, which says
// what its columns are (BIDS specification, "Physiological recordings").
//
// Row k is sample k, at StartTime + k / SamplingFrequency; StartTime counts from the run's first trigger, with which
// imaging begins, and so is negative. Columns: every pressure channel, commanded_mL (the commanded volume at the
// sample's time, straight between two positions), trigger (1 in the row nearest to a rising edge, else 0). A value
// that is missing is "n/a".

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string_view>

#include "protocol/runfile/reader.hpp"

namespace diastole {

/// Precondition, here and below: the run holds at least two pressure rows.
nlohmann::ordered_json bids_description(const runfile::RunFile& file);

/// Hands over the table, tab-separated, some rows at a time.
void bids_table(const runfile::RunFile& file, const std::function<void(std::string_view)>& take);

/// The same as a gzip file, in which equal tables are equal bytes. Throws HardwareError if the disk does not take it; then
/// nothing is left behind.
void write_bids_table(const runfile::RunFile& file, const std::filesystem::path& table);

}  // namespace diastole
