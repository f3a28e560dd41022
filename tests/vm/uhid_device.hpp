#pragma once
// A HID device of the kernel's own making (/dev/uhid), which gets a hidraw node.

#include <thread>

#include "host/transport/descriptor.hpp"
#include "tests/vm/simulated_1208ls.hpp"

namespace diastole::vm {

inline constexpr uint16_t uhid_vendor = 0x1209;
inline constexpr uint16_t uhid_product = 0x0001;

class UhidDevice {
 public:
  /// Throws std::runtime_error with what failed.
  explicit UhidDevice(Simulated1208ls& device);
  ~UhidDevice();
  UhidDevice(const UhidDevice&) = delete;
  UhidDevice& operator=(const UhidDevice&) = delete;

 private:
  void serve(const std::stop_token& stop);

  Simulated1208ls& device_;
  Descriptor uhid_;
  std::jthread thread_;
};

}  // namespace diastole::vm
