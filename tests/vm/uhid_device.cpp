#include "tests/vm/uhid_device.hpp"

#include <fcntl.h>
#include <linux/input.h>
#include <linux/uhid.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>

namespace diastole::vm {

UhidDevice::UhidDevice(Simulated1208ls& device)
    : device_(device), uhid_(::open("/dev/uhid", O_RDWR | O_CLOEXEC)) {
  if (!uhid_.valid()) throw std::runtime_error("/dev/uhid cannot be opened");
  uhid_event event{};
  event.type = UHID_CREATE2;
  auto& create = event.u.create2;
  std::strcpy(reinterpret_cast<char*>(create.name), "simulated USB-1208LS");
  create.bus = BUS_USB;
  create.vendor = uhid_vendor;
  create.product = uhid_product;
  create.rd_size = sizeof(report_descriptor);
  std::copy(std::begin(report_descriptor), std::end(report_descriptor), create.rd_data);
  if (::write(uhid_.get(), &event, sizeof(event)) < 0) throw std::runtime_error("uhid refuses the device");
  thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop); });
}

UhidDevice::~UhidDevice() {
  thread_.request_stop();
  thread_.join();
}

void UhidDevice::serve(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    pollfd state{uhid_.get(), POLLIN, 0};
    if (::poll(&state, 1, 50) <= 0) continue;
    uhid_event event{};
    if (::read(uhid_.get(), &event, sizeof(event)) <= 0) continue;
    if (event.type == UHID_OUTPUT && event.u.output.size > 0) {
      device_.command({event.u.output.data + 1, event.u.output.size - size_t{1}});  // behind the report id
    } else if (event.type == UHID_GET_REPORT) {
      uhid_event reply{};
      reply.type = UHID_GET_REPORT_REPLY;
      reply.u.get_report_reply.id = event.u.get_report.id;
      const std::vector<uint8_t> block = device_.next_block();
      reply.u.get_report_reply.size = static_cast<uint16_t>(block.size() + 1);
      std::copy(block.begin(), block.end(), reply.u.get_report_reply.data + 1);
      (void)!::write(uhid_.get(), &reply, sizeof(reply));
    }
  }
}

}  // namespace diastole::vm
