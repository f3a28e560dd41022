#pragma once
// A HID device, as an instrument's driver sees it.

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace diastole::daq {

class HidPort {
 public:
  virtual ~HidPort() = default;
  /// False when the device is gone; `problem()` says why.
  [[nodiscard]] virtual bool write_output(std::span<const uint8_t> report) = 0;
  /// A feature report, its id (0) in front, when the device has it; empty when it had none within a second or is
  /// gone.
  [[nodiscard]] virtual std::vector<uint8_t> read_feature(size_t bytes) = 0;
  [[nodiscard]] virtual std::string problem() const = 0;
};

struct HidAddress {
  uint16_t vendor_id = 0;
  uint16_t product_id = 0;
  std::string serial;  ///< empty: the only or first one
};

/// Throws HardwareError when there is no such device or it may not be opened.
using OpenHid = std::function<std::unique_ptr<HidPort>(const HidAddress&)>;

/// Through hidapi, which the build links with its libusb backend: the kernel leaves some instruments, the
/// USB-1208LS among them, without a hidraw node.
std::unique_ptr<HidPort> open_hidapi(const HidAddress& address);

}  // namespace diastole::daq
