#include "host/daq/hid_port.hpp"

#include <fmt/format.h>
#include <hidapi/hidapi.h>

#include <cwchar>

#include "protocol/contract/input_error.hpp"

namespace diastole::daq {
namespace {

std::string narrow(const wchar_t* text) {
  std::string out;
  for (; text != nullptr && *text != 0; ++text)
    out.push_back(*text < 128 ? static_cast<char>(*text) : '?');
  return out;
}

class HidapiPort final : public HidPort {
 public:
  explicit HidapiPort(hid_device* device) : device_(device) {}

  bool write_output(std::span<const uint8_t> report) override {
    std::vector<uint8_t> bytes{0};  // report id
    bytes.insert(bytes.end(), report.begin(), report.end());
    return hid_write(device_.get(), bytes.data(), bytes.size()) >= 0;
  }

  std::vector<uint8_t> read_feature(size_t bytes) override {
    std::vector<uint8_t> report(bytes);
    const int got = hid_get_feature_report(device_.get(), report.data(), report.size());
    report.resize(static_cast<size_t>(std::max(0, got)));
    return report;
  }

  [[nodiscard]] std::string problem() const override { return narrow(hid_error(device_.get())); }

 private:
  struct Close {
    void operator()(hid_device* device) const { hid_close(device); }
  };
  std::unique_ptr<hid_device, Close> device_;
};

bool is_plugged_in(const HidAddress& address) {
  const std::unique_ptr<hid_device_info, decltype(&hid_free_enumeration)> found(
      hid_enumerate(address.vendor_id, address.product_id), &hid_free_enumeration);
  return found != nullptr;
}

}  // namespace

std::unique_ptr<HidPort> open_hidapi(const HidAddress& address) {
  hid_init();
  const std::wstring serial(address.serial.begin(), address.serial.end());
  hid_device* device =
      hid_open(address.vendor_id, address.product_id, serial.empty() ? nullptr : serial.c_str());
  if (device != nullptr) return std::make_unique<HidapiPort>(device);
  const std::string name = fmt::format("USB device {:04x}:{:04x}{}{}", address.vendor_id, address.product_id,
                                       serial.empty() ? "" : " serial ", address.serial);
  const bool plugged_in = is_plugged_in(address);
  const std::string problem = narrow(hid_error(nullptr));
  hid_exit();  // the next attempt looks anew: where no udev runs, libusb hears of no new device
  if (plugged_in) {
    throw HardwareError(name, "cannot be opened: " + problem,
                        "Check that no other program holds it and that you may use it: a udev rule gives "
                        "access (docs/instruments.md).");
  }
  throw HardwareError(name, "is not there", "Plug it in (lsusb shows it), and check serial in [daq].");
}

}  // namespace diastole::daq
