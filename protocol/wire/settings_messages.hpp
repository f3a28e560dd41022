#pragma once
// The machine's settings: kept by the controller, read and written by the host.

#include <cstdint>

#include "protocol/wire/common_requests.hpp"
#include "protocol/wire/field_codec.hpp"
#include "protocol/wire/machine_settings.hpp"
#include "protocol/wire/message_type.hpp"

namespace diastole::wire {

// Host → controller: answer with SettingsReport.
//
// Example ReadSettings: 07 01
using ReadSettings = BareRequest<MessageType::ReadSettings>;

// Host → controller: keep these settings in flash and use them from now on; nothing may be moving, and geometry
// and limits have to be configured anew. One out of its range (setting_list.inc) is refused with
// Refusal::setting_out_of_range, its number in `segment`, and the nearest allowed value.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    4 microsteps                   a full step, as the driver's switches are set
//        6    4 steps_per_rev                full steps
//       10    4 bore_um                      of the pump's cylinder
//       14    4 screw_mrev_per_m             turns of the lead screw, in thousandths, on a metre
//       18    4 calibration_ppm              volume above the nominal one, signed
//       22    4 backlash_nm                  play of the lead screw
//       26    4 travel_um                    the furthest from home
//       30    4 full_step_rate_Hz            limit of motor and driver
//       34    4 ttl_active_low               polarity of the TTL
//       38    4 r_wave_uV                    height at the scanner's input
//       42    4 r_wave_us                    length
//       46    1 board_name_size              0 … 20
//       47    n board_name                   UTF-8
//
// Example WriteSettings: 08 00 10 00 00 00 C8 00 00 00 A0 86 01 00 F0 9C 09 00 24 FA FF FF 50 C3 00 00 A0 BB
//   0D 00 30 75 00 00 00 00 00 00 20 4E 00 00 30 75 00 00 04 72 69 67 41
struct WriteSettings {
  static constexpr MessageType kType = MessageType::WriteSettings;
  std::uint16_t request_id = 0;
  MachineSettings settings;

  static constexpr void layout(auto& self, auto& visit) {
    visit.field("request_id", self.request_id);
    MachineSettings::layout(self.settings, visit);
  }
  static constexpr WriteSettings example() {
    return {.request_id = 8,
            .settings = {.microsteps = 16,
                         .calibration_ppm = -1500,
                         .backlash_nm = 50'000,
                         .board_name_size = 4,
                         .board_name = {'r', 'i', 'g', 'A'}}};
  }
};

// Controller → host, the answer to ReadSettings: the settings in force and what follows from them. While none
// have ever been written (records_written 0) they are the initial ones and bind nobody: the controller takes
// geometry and limits as Configure brings them.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    4 records_written              number of the record in force, from 1; 0: none in flash
//        6    4 microstep_pL                 volume of one microstep
//       10    4 backlash_microsteps
//       14    n settings                     as in WriteSettings, from microsteps on
//
// Example SettingsReport: 07 01 03 00 00 00 21 E4 76 00 32 00 00 00 08 00 00 00 C8 00 00 00 A0 86 01 00 F0 9C
//   09 00 00 00 00 00 50 C3 00 00 A0 BB 0D 00 30 75 00 00 00 00 00 00 20 4E 00 00 30 75 00 00 04 72
//   69 67 41
struct SettingsReport {
  static constexpr MessageType kType = MessageType::SettingsReport;
  std::uint16_t request_id = 0;
  std::uint32_t records_written = 0;
  std::uint32_t microstep_pL = 0;
  std::uint32_t backlash_microsteps = 0;
  MachineSettings settings;

  static constexpr void layout(auto& self, auto& visit) {
    visit.field("request_id", self.request_id);
    visit.field("records_written", self.records_written);
    visit.field("microstep_pL", self.microstep_pL);
    visit.field("backlash_microsteps", self.backlash_microsteps);
    MachineSettings::layout(self.settings, visit);
  }
  static constexpr SettingsReport example() {
    return {.request_id = 0x0107,
            .records_written = 3,
            .microstep_pL = 7'791'649,
            .backlash_microsteps = 50,
            .settings = {.backlash_nm = 50'000, .board_name_size = 4, .board_name = {'r', 'i', 'g', 'A'}}};
  }
};

}  // namespace diastole::wire
