#pragma once
// udev rules for one rig: its controller's line by the serial number of the USB adapter, its GPIO chip by where it sits. They
// give them to a group that nobody but the daemon's user belongs to, so that all others go through the daemon.

#include <filesystem>
#include <string>
#include <vector>

#include "host/config/rig_config.hpp"

namespace diastole {

inline constexpr const char* device_group = "diastole-devices";

/// Lines of a rules file for the port and the GPIO chip that the rig file names, which must be there now. An adapter without a
/// serial number, or with one that does not fit into a rule, is identified by the socket that it is plugged into. `sys` and `dev`
/// stand for /sys and /dev. Throws HardwareError if the port or the chip is not there.
std::vector<std::string> udev_rules(const RigConfig& rig, const std::filesystem::path& sys = "/sys",
                                    const std::filesystem::path& dev = "/dev");

}  // namespace diastole
