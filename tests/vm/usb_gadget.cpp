#include "tests/vm/usb_gadget.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/usb/ch9.h>
#include <linux/usb/functionfs.h>
#include <poll.h>
#include <sys/mount.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace diastole::vm {
namespace {

namespace fs = std::filesystem;

const fs::path gadget = "/sys/kernel/config/usb_gadget/instrument";
const fs::path functions = "/run/functions";
constexpr uint8_t get_report = 0x01;
constexpr uint8_t set_report = 0x09;
constexpr uint8_t report_descriptor_type = 0x22;

void put(const fs::path& path, const std::string& text) {
  std::ofstream stream(path);
  if (!(stream << text << std::flush)) throw std::runtime_error("cannot write " + path.string());
}

template <typename Value>
void append(std::vector<uint8_t>& bytes, const Value& value) {
  const auto* at = reinterpret_cast<const uint8_t*>(&value);
  bytes.insert(bytes.end(), at, at + sizeof(Value));
}

/// One interface of class HID with an interrupt endpoint into the host.
std::vector<uint8_t> interface_descriptors() {
  const auto endpoint = [](uint8_t interval) {
    return std::vector<uint8_t>{7, USB_DT_ENDPOINT, 0x81, USB_ENDPOINT_XFER_INT, 8, 0, interval};
  };
  const std::vector<uint8_t> interface { 9, USB_DT_INTERFACE, 0, 0, 1, USB_CLASS_HID, 0, 0, 0 };
  const std::vector<uint8_t> hid{9, 0x21, 0x10, 0x01, 0, 1, report_descriptor_type, sizeof(report_descriptor),
                                 0};
  std::vector<uint8_t> bytes;
  for (const uint8_t interval :
       {uint8_t{10}, uint8_t{7}}) {  // full speed in ms, high speed in 2^(n-1) / 8 ms
    for (const auto& part : {interface, hid, endpoint(interval)})
      bytes.insert(bytes.end(), part.begin(), part.end());
  }
  return bytes;
}

void describe(int control) {
  const std::vector<uint8_t> descriptors = interface_descriptors();
  std::vector<uint8_t> bytes;
  const usb_functionfs_descs_head_v2 head{
      FUNCTIONFS_DESCRIPTORS_MAGIC_V2,
      static_cast<uint32_t>(sizeof(head) + 2 * sizeof(uint32_t) + descriptors.size()),
      FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC};
  append(bytes, head);
  append(bytes, uint32_t{3});
  append(bytes, uint32_t{3});
  bytes.insert(bytes.end(), descriptors.begin(), descriptors.end());
  if (::write(control, bytes.data(), bytes.size()) < 0) throw std::runtime_error("descriptors are not taken");
  const usb_functionfs_strings_head strings{FUNCTIONFS_STRINGS_MAGIC, sizeof(strings), 0, 0};
  if (::write(control, &strings, sizeof(strings)) < 0) throw std::runtime_error("strings are not taken");
}

}  // namespace

UsbGadget::UsbGadget(Simulated1208ls& device) : device_(device) {
  fs::create_directory(gadget);
  put(gadget / "idVendor", "0x09db");
  put(gadget / "idProduct", "0x007a");
  put(gadget / "bcdUSB", "0x0110");
  fs::create_directories(gadget / "strings/0x409");
  put(gadget / "strings/0x409/serialnumber", "01AB23CD");
  put(gadget / "strings/0x409/product", "simulated USB-1208LS");
  fs::create_directory(gadget / "configs/c.1");
  fs::create_directory(gadget / "functions/ffs.hid");
  fs::create_symlink(gadget / "functions/ffs.hid", gadget / "configs/c.1/ffs.hid");
  fs::create_directories(functions);
  if (::mount("hid", functions.c_str(), "functionfs", 0, nullptr) != 0) {
    throw std::runtime_error(fmt::format("functionfs cannot be mounted: {}", std::strerror(errno)));
  }
  control_ = Descriptor(::open((functions / "ep0").c_str(), O_RDWR | O_CLOEXEC));
  if (!control_.valid()) throw std::runtime_error("ep0 cannot be opened");
  describe(control_.get());
  thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop); });
  put(gadget / "UDC", "dummy_udc.0");
}

UsbGadget::~UsbGadget() {
  std::ofstream(gadget / "UDC") << "\n" << std::flush;
  thread_.request_stop();
  thread_.join();
  control_ = Descriptor();
  ::umount(functions.c_str());
  fs::remove(gadget / "configs/c.1/ffs.hid");
  fs::remove(gadget / "functions/ffs.hid");
  fs::remove(gadget / "configs/c.1");
  fs::remove(gadget / "strings/0x409");
  fs::remove(gadget);
}

void UsbGadget::serve(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    pollfd state{control_.get(), POLLIN, 0};
    if (::poll(&state, 1, 50) <= 0) continue;
    usb_functionfs_event event{};
    if (::read(control_.get(), &event, sizeof(event)) != sizeof(event)) continue;
    if (event.type != FUNCTIONFS_SETUP) continue;
    const usb_ctrlrequest& setup = event.u.setup;
    std::vector<uint8_t> data(setup.wLength);
    if ((setup.bRequestType & USB_DIR_IN) == 0) {
      const ssize_t got = ::read(control_.get(), data.data(), data.size());
      data.resize(static_cast<size_t>(std::max<ssize_t>(got, 0)));
      if (setup.bRequest == set_report) device_.command(data);
      continue;
    }
    std::vector<uint8_t> answer;
    if (setup.bRequest == get_report) answer = device_.next_block();
    if (setup.bRequest == USB_REQ_GET_DESCRIPTOR && setup.wValue >> 8U == report_descriptor_type) {
      answer.assign(std::begin(report_descriptor), std::end(report_descriptor));
    }
    if (answer.empty()) {
      (void)!::read(control_.get(), data.data(), 0);  // the wrong direction: refuses the request
      continue;
    }
    answer.resize(std::min<size_t>(answer.size(), setup.wLength));
    (void)!::write(control_.get(), answer.data(), answer.size());
  }
}

}  // namespace diastole::vm
