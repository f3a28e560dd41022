#include "host/daq/driver.hpp"

#include <array>

namespace diastole::daq {
namespace {

constexpr std::array known{
#define DIASTOLE_DAQ_DRIVER(name) &name##_driver,
#include "host/daq/driver_list.inc"
};

}  // namespace

std::span<const Driver* const> drivers() { return known; }

}  // namespace diastole::daq
