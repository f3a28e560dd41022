// The USB-1208LS driver through hidapi and the kernel. Built twice: with hidapi's libusb backend against a USB gadget,
// and with its hidraw backend against uhid (DIASTOLE_VM_HIDRAW).

#include <gmock/gmock.h>

#include <chrono>
#include <filesystem>
#include <memory>

#include "host/daq/usb1208ls.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/vm/simulated_1208ls.hpp"
#ifdef DIASTOLE_VM_HIDRAW
#include "tests/vm/uhid_device.hpp"
#else
#include "tests/vm/usb_gadget.hpp"
#endif

namespace diastole::vm {
namespace {

namespace fs = std::filesystem;

#ifdef DIASTOLE_VM_HIDRAW
using Plugged = UhidDevice;
const daq::HidAddress address{uhid_vendor, uhid_product, {}};
#else
using Plugged = UsbGadget;
const daq::HidAddress address{daq::usb1208ls::vendor_id, daq::usb1208ls::product_id, {}};
#endif

std::unique_ptr<daq::BlockInstrument> open_patiently() {
  daq::Usb1208lsSetup setup;
  setup.address = address;
  setup.queue = {{0, daq::usb1208ls::ranges[1]}};
  for (const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);;) {
    try {
      return daq::open_usb1208ls(setup, daq::open_hidapi);
    } catch (const HardwareError&) {
      if (std::chrono::steady_clock::now() > end) throw;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }
}

TEST(Hid, BlocksComeThroughHidapiAndALostOneIsAHole) {
  Simulated1208ls device;
  device.lost = [](unsigned block) { return block == 7; };
  const Plugged plugged(device);
  const auto instrument = open_patiently();
  ASSERT_TRUE(instrument->start(instrument->plan_rate(300).rate_Hz).ok);
  uint64_t expected = 0;
  for (int block = 0; block < 100; ++block) {
    daq::Batch batch;
    const daq::Outcome outcome = instrument->read(batch);
    ASSERT_TRUE(outcome.ok) << outcome.fault;
    if (block == 7) expected += 64;
    ASSERT_EQ(batch.first_index, expected);
    ASSERT_EQ(batch.volts.size(), 64U);
    for (size_t i = 0; i < 64; ++i)
      ASSERT_NEAR(batch.volts[i], static_cast<double>((expected + i) % 2048) * 10 / 2047, 1e-9);
    expected += 64;
  }
  instrument->stop();
  for (int i = 0; i < 100 && device.stops < 2; ++i)  // one before the scan, one now
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(device.stops, 2);
  EXPECT_EQ(device.scans, 1);
  EXPECT_EQ(device.channels, 1);
}

TEST(Hid, ADeviceThatIsPulledOutFailsAndComesBack) {
  Simulated1208ls device;
  auto plugged = std::make_unique<Plugged>(device);
  const auto instrument = open_patiently();
  ASSERT_TRUE(instrument->start(300.48).ok);
  daq::Batch batch;
  ASSERT_TRUE(instrument->read(batch).ok);
  plugged.reset();
  const daq::Outcome gone = instrument->read(batch);
  EXPECT_FALSE(gone.ok);
  EXPECT_FALSE(gone.fault.empty());
  EXPECT_FALSE(instrument->start(300.48).ok);
  plugged = std::make_unique<Plugged>(device);
  bool back = false;
  for (int i = 0; i < 400 && !back; ++i) {
    back = instrument->start(300.48).ok;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  ASSERT_TRUE(back);
  ASSERT_TRUE(instrument->read(batch).ok);
  EXPECT_EQ(batch.first_index, 0U);
}

TEST(Hid, AnAbsentDeviceIsAHardwareError) { EXPECT_THROW((void)daq::open_hidapi(address), HardwareError); }

#ifndef DIASTOLE_VM_HIDRAW
TEST(Hid, TheKernelGivesTheInstrumentNoHidrawNode) {
  Simulated1208ls device;
  const Plugged plugged(device);
  const auto instrument = open_patiently();
  EXPECT_FALSE(fs::exists("/sys/class/hidraw/hidraw0"))
      << "hidapi's libusb backend is what this instrument needs";
}
#endif

}  // namespace
}  // namespace diastole::vm
