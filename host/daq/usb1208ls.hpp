#pragma once
// The USB-1208LS as a block instrument, over any HID port.

#include "host/daq/hid_port.hpp"
#include "host/daq/instrument.hpp"
#include "host/daq/usb1208ls_bytes.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole::daq {

struct Usb1208lsSetup {
  HidAddress address{usb1208ls::vendor_id, usb1208ls::product_id, {}};
  std::vector<usb1208ls::QueueEntry> queue;  ///< one a channel, 1 to 4
};

/// What the rig file says of it (usb1208ls.cpp draws its keys). Throws InputError.
Usb1208lsSetup read_usb1208ls(TableReader& daq, std::vector<TableReader>& channels);

/// Opens the device by `open`, now and again whenever it failed. Throws HardwareError.
std::unique_ptr<BlockInstrument> open_usb1208ls(Usb1208lsSetup setup, OpenHid open);

}  // namespace diastole::daq
