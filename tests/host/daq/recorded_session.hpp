#pragma once
// A recorded session with an instrument, recordings/DRIVER.session: what went over the line, and what the driver must
// make of it.
//
//   # a remark
//   daq KEY = VALUE          a line of [daq]
//   channel KEY = VALUE      one [[daq.channel]] each
//   > 01 03 d7 3c            the driver asks
//   < 01 03 04 00            the instrument answers
//   = 0.25 3.25              a reading's volts; of a block: the number of its first sample and that sample's volts

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace diastole::daq {

struct RecordedSession {
  struct Step {
    bool asked = true;  ///< else answered
    std::vector<uint8_t> bytes;
  };
  std::string daq;       ///< TOML
  std::string channels;  ///< TOML
  std::vector<Step> steps;
  std::vector<std::vector<double>> readings;
};

/// Empty (no steps) if there is no such file.
RecordedSession read_session(const std::filesystem::path& path);

/// The instrument's part over a stream of bytes: waits for what is asked, which must be as recorded, and answers.
/// `receive` gives what arrived within some milliseconds; `stopped` ends it early. Returns what was wrong, or nothing.
std::string play(const RecordedSession& session, const std::function<std::vector<uint8_t>()>& receive,
                 const std::function<void(std::span<const uint8_t>)>& send,
                 const std::function<bool()>& stopped);

}  // namespace diastole::daq
