#include "host/daq/driver.hpp"

#include <array>

namespace diastole::daq {
namespace {

constexpr auto known = std::to_array<Driver>({
#define DIASTOLE_DAQ_DRIVER(name, configure) {name, configure},
#include "host/daq/driver_list.inc"
#undef DIASTOLE_DAQ_DRIVER
});

}  // namespace

std::span<const Driver> drivers() { return known; }

}  // namespace diastole::daq
