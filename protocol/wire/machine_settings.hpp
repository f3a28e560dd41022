#pragma once
// What belongs to the machine and not to a session, as the controller keeps it in flash and as it travels in
// WriteSettings and SettingsReport. The numbers come from setting_list.inc.

#include <array>
#include <cstddef>
#include <cstdint>

namespace diastole::wire {

enum class Setting : std::uint8_t {
#define DIASTOLE_SETTING(number, name, least, initial, most, shown, scale, explanation) name = number,
#include "protocol/wire/setting_list.inc"
};

struct MachineSettings {
  static constexpr std::size_t kMaxNameBytes = 20;

#define DIASTOLE_SETTING(number, name, least, initial, most, shown, scale, explanation) \
  std::int32_t name = initial;
#include "protocol/wire/setting_list.inc"
  std::uint8_t board_name_size = 0;
  std::array<std::uint8_t, kMaxNameBytes> board_name{};  ///< UTF-8, for people

  /// Its fields as part of a message or record, in the order of setting_list.inc, the name last. Of a record that an
  /// older firmware wrote only the settings below `known`, which it knew.
  static constexpr void layout(auto& self, auto& visit, int known = 256) {
#define DIASTOLE_SETTING(number, name, least, initial, most, shown, scale, explanation) \
  if ((number) < known) visit.field(#name, self.name);
#include "protocol/wire/setting_list.inc"
    visit.list("board_name", self.board_name_size, self.board_name);
  }
  constexpr bool operator==(const MachineSettings&) const = default;
};

/// A setting outside what it may be; `allowed` is the nearest value inside.
struct SettingOutOfRange {
  bool found = false;
  Setting setting{};
  std::int32_t asked = 0;
  std::int32_t allowed = 0;
};

/// The first setting out of its range, if any.
constexpr SettingOutOfRange out_of_range(const MachineSettings& settings) {
#define DIASTOLE_SETTING(number, name, least, initial, most, shown, scale, explanation) \
  if (settings.name < (least)) return {true, Setting::name, settings.name, least};      \
  if (settings.name > (most)) return {true, Setting::name, settings.name, most};
#include "protocol/wire/setting_list.inc"
  return {};
}

// What follows from settings that are in range, in whole numbers, the same on controller and host.

/// Volume of one microstep, π/4 bore² / (screw · steps · microsteps), times 1 + calibration, in picolitres.
constexpr std::uint32_t microstep_pL(const MachineSettings& settings) {
  const auto bore_um = static_cast<std::uint64_t>(settings.bore_um);
  const std::uint64_t area_um2 = bore_um * bore_um * 7'853'982 / 10'000'000;
  const std::uint64_t steps_per_km = static_cast<std::uint64_t>(settings.screw_mrev_per_m) *
                                     static_cast<std::uint64_t>(settings.steps_per_rev) *
                                     static_cast<std::uint64_t>(settings.microsteps);
  // 1e9 µm of 1e-3 pL/µm³ each; beyond what a microstep may be it only needs to stay beyond.
  const std::uint64_t nominal_pL = (area_um2 * 1'000'000 + steps_per_km / 2) / steps_per_km;
  if (nominal_pL > 3'600'000'000) return UINT32_MAX;
  return static_cast<std::uint32_t>(
      (nominal_pL * static_cast<std::uint64_t>(1'000'000 + settings.calibration_ppm) + 500'000) / 1'000'000);
}

/// Microsteps that take up the play, rounded.
constexpr std::uint32_t backlash_microsteps(const MachineSettings& settings) {
  const std::uint64_t steps_per_m = static_cast<std::uint64_t>(settings.screw_mrev_per_m) *
                                    static_cast<std::uint64_t>(settings.steps_per_rev) *
                                    static_cast<std::uint64_t>(settings.microsteps) / 1000;
  return static_cast<std::uint32_t>(
      (steps_per_m * static_cast<std::uint64_t>(settings.backlash_nm) + 500'000'000) / 1'000'000'000);
}

/// The volume that the piston may displace from home, in microlitres, at the nominal bore.
constexpr std::uint64_t travel_uL(const MachineSettings& settings) {
  const auto bore_um = static_cast<std::uint64_t>(settings.bore_um);
  const std::uint64_t area_um2 = bore_um * bore_um * 7'853'982 / 10'000'000;
  return area_um2 / 1000 * static_cast<std::uint64_t>(settings.travel_um) / 1'000'000;
}

}  // namespace diastole::wire
