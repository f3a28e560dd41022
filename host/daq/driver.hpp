#pragma once
// The drivers of driver_list.inc. A driver is one file with one function, `configure`: it reads what it needs
// of the rig file at start-up (strictly, with line numbers in its messages) and returns how to open the
// instrument. Of one that speaks to a device the tests replay a recording over its line:
// tests/host/daq/recordings/NAME.session.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/daq/hid_port.hpp"
#include "host/daq/instrument.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole::daq {

struct OpenOptions {
  /// Where the instrument is, instead of what the rig file says ("127.0.0.1:1502").
  std::optional<std::string> address = {};
  /// Timeout for one answer, at least, on the wall's clock; a conducted simulation is patient with a loaded machine.
  int least_timeout_ms = 0;
  /// The time by which an instrument that is not there samples, and by which the timeout counts that a simulation has
  /// ended by closing the connection; empty: CLOCK_MONOTONIC.
  std::function<uint64_t()> now_ns = {};
  OpenHid open_hid = {};  ///< instead of open_hidapi
};

/// The timeout that a rig file may give an instrument for one answer: the samples that come due meanwhile are lost,
/// and the end of a run waits for it.
inline constexpr int most_timeout_ms = 1000;

/// Throws HardwareError when the instrument is not there or is not what it should be.
using OpenInstrument = std::function<std::unique_ptr<Instrument>(const OpenOptions&)>;

/// `daq` is the table [daq], `channels` its [[daq.channel]] blocks; keys common to all drivers are read
/// already.
using Configure = OpenInstrument (*)(TableReader& daq, std::vector<TableReader>& channels);

/// What carries the instrument's bytes: nothing, TCP (keys host, port, timeout_ms), a serial port (port, timeout_ms) or
/// OpenOptions::open_hid.
enum class Line { none, tcp, serial, hid };

struct Driver {
  std::string_view name;  ///< what [daq] driver = "..." says
  Line line;
  Configure configure;
};

#define DIASTOLE_DAQ_DRIVER(name) extern const Driver name##_driver;
#include "host/daq/driver_list.inc"

std::span<const Driver* const> drivers();

}  // namespace diastole::daq
