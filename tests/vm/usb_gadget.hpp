#pragma once
// A USB-1208LS on dummy_hcd, the kernel's cable from a machine to itself: its descriptors and requests are served
// from here through FunctionFS. To the host side it is a true USB device, with the instrument's own numbers.

#include <thread>

#include "host/transport/descriptor.hpp"
#include "tests/vm/simulated_1208ls.hpp"

namespace diastole::vm {

class UsbGadget {
 public:
  /// Plugs the device in. Throws std::runtime_error with what failed.
  explicit UsbGadget(Simulated1208ls& device);
  /// Pulls it out.
  ~UsbGadget();
  UsbGadget(const UsbGadget&) = delete;
  UsbGadget& operator=(const UsbGadget&) = delete;

 private:
  void serve(const std::stop_token& stop);

  Simulated1208ls& device_;
  Descriptor control_;
  std::jthread thread_;
};

}  // namespace diastole::vm
