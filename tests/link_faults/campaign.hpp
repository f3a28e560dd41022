#pragma once
// Two ends of the reliable link and a bad line between them, both ways: numbered commands down, numbered
// telemetry up. The line is bad for a while, then good for a while, and so on until enough frames have passed.

#include <cstdint>
#include <string>

#include "tests/link_faults/line_faults.hpp"

namespace diastole::link_faults {

struct CampaignOptions {
  FaultRates rates;
  std::uint64_t frames = 10'000;  ///< both directions together
  std::uint64_t seed = 1;
  std::uint64_t bad_ms = 300;  ///< length of each bad spell
  /// The campaign's own check: slips one well-formed command that nobody sent into the line.
  bool forge_a_command = false;
};

struct CampaignReport {
  FaultCounts line;             ///< both directions
  std::uint64_t commands = 0;   ///< carried out at the controller
  std::uint64_t telemetry = 0;  ///< taken in by the host
  std::uint64_t resent = 0;
  std::uint64_t rejected = 0;           ///< by CRC or framing
  std::uint64_t wrong = 0;              ///< not the next one that was sent, to the byte
  std::uint64_t missing = 0;            ///< handed to the link and never delivered
  std::uint64_t worst_recovery_ms = 0;  ///< from the line's becoming good until all is delivered
};

CampaignReport run_campaign(const CampaignOptions& options);

std::string table_head();
std::string table_row(const CampaignOptions& options, const CampaignReport& report);

}  // namespace diastole::link_faults
