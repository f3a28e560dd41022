// Modbus TCP.
//
//   [daq]
//   driver = "modbus-tcp"
//   host = "192.168.1.207"
//   port = 502
//   timeout_ms = 20
//   ...                             # registers: modbus_registers.hpp
//
// After a time-out a late answer may still arrive and would be taken for the next one. So every failure
// closes the connection, and the next reading opens a new one. A reading takes no longer than timeout_ms, with
// its reconnecting; the host's name is looked up once, at the start.

#include <fmt/format.h>
#include <modbus/modbus.h>
#include <netdb.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>

#include "host/daq/driver.hpp"
#include "host/daq/modbus_registers.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::daq {
namespace {

struct TcpAddress {
  std::string host;
  int port = 502;
  int timeout_ms = 20;
};

/// The numeric addresses of a host. Throws HardwareError if it has none.
std::vector<std::string> addresses_of(const std::string& host) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  std::vector<std::string> addresses;
  if (getaddrinfo(host.c_str(), nullptr, &hints, &found) == 0) {
    const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> list(found, &freeaddrinfo);
    for (const addrinfo* each = list.get(); each != nullptr; each = each->ai_next) {
      std::array<char, NI_MAXHOST> numeric{};
      if (getnameinfo(each->ai_addr, each->ai_addrlen, numeric.data(), numeric.size(), nullptr, 0,
                      NI_NUMERICHOST) == 0) {
        addresses.emplace_back(numeric.data());
      }
    }
  }
  if (!addresses.empty()) return addresses;
  throw HardwareError("modbus-tcp at " + host, "is no host that can be found",
                      "Check host in [daq], or give the address in numbers.");
}

class TcpLine final : public ModbusLine {
 public:
  TcpLine(TcpAddress address, int unit, const OpenOptions& options)
      : at_(std::move(address)),
        unit_(unit),
        wall_timeout_ms_(std::max(at_.timeout_ms, options.least_timeout_ms)),
        now_ns_(options.now_ns ? options.now_ns : [] { return uint64_t{0}; }) {
    find();
  }

  [[nodiscard]] std::string describe() const override {
    return fmt::format("modbus-tcp at {}:{}", at_.host, at_.port);
  }
  [[nodiscard]] std::string remedy() const override {
    return "Check that the instrument is powered and connected, and host and port in [daq].";
  }
  [[nodiscard]] bool ready() const override { return context_ != nullptr; }

  std::string ask(bool input_function, int first, std::span<uint16_t> out) override {
    const uint64_t asked_ns = now_ns_();
    const Moment give_up = deadline();
    if (context_ == nullptr) {
      if (std::string fault = connect(give_up); !fault.empty()) return fault;
    }
    set_response_timeout(give_up);
    const auto read = input_function ? modbus_read_input_registers : modbus_read_registers;
    const int count = static_cast<int>(out.size());
    if (read(context_.get(), first, count, out.data()) == count) return {};
    const int error = errno;
    std::string reason = modbus_strerror(error);
    if (error == ETIMEDOUT) reason = no_answer_within(wall_timeout_ms_);
    if (simulated_wait_ms(asked_ns) >= at_.timeout_ms) reason = no_answer_within(at_.timeout_ms);
    context_.reset();
    return reason;
  }

 private:
  using Moment = std::chrono::steady_clock::time_point;

  [[nodiscard]] Moment deadline() const {
    return std::chrono::steady_clock::now() + std::chrono::milliseconds(wall_timeout_ms_);
  }

  static std::string no_answer_within(int ms) { return fmt::format("no answer within {} ms", ms); }

  /// To the nearest millisecond: clocks drift.
  [[nodiscard]] int simulated_wait_ms(uint64_t asked_ns) const {
    constexpr uint64_t ns_per_ms = 1'000'000;
    return static_cast<int>((now_ns_() - asked_ns + ns_per_ms / 2) / ns_per_ms);
  }

  /// Connects to the first of the host's addresses that answers, and keeps to it.
  void find() {
    std::string fault;
    for (const std::string& address : addresses_of(at_.host)) {
      address_ = address;
      fault = connect(deadline());
      if (fault.empty()) return;
    }
    throw HardwareError(describe(), fault, remedy());
  }

  /// The timeout for whatever is asked next: until `give_up`, and a millisecond at least.
  void set_response_timeout(Moment give_up) {
    const auto left =
        std::chrono::duration_cast<std::chrono::microseconds>(give_up - std::chrono::steady_clock::now());
    const auto left_us = static_cast<uint32_t>(std::max<int64_t>(left.count(), 1000));
    modbus_set_response_timeout(context_.get(), left_us / 1'000'000, left_us % 1'000'000);
  }

  /// Empty, or why there is no connection.
  std::string connect(Moment give_up) {
    context_.reset(modbus_new_tcp_pi(address_.c_str(), std::to_string(at_.port).c_str()));
    if (context_ == nullptr) return "is not an address";
    modbus_set_byte_timeout(context_.get(), 0, 0);  // the response's time-out is for all of its bytes
    modbus_set_slave(context_.get(), unit_);
    set_response_timeout(give_up);
    if (modbus_connect(context_.get()) == 0) return {};
    const std::string reason = modbus_strerror(errno);
    context_.reset();
    return "does not connect: " + reason;
  }

  TcpAddress at_;
  int unit_;
  int wall_timeout_ms_;
  std::function<uint64_t()> now_ns_;  // simulated; stands still in real time
  std::string address_;
  ModbusContext context_;
};

/// Splits "host:port".
void take_address(TcpAddress& at, const std::string& address) {
  const size_t colon = address.rfind(':');
  const char* end = address.data() + address.size();
  if (colon == std::string::npos || std::from_chars(address.data() + colon + 1, end, at.port).ptr != end) {
    throw InputError({"", "--daq " + address, "is not HOST:PORT", "For example --daq 127.0.0.1:1502."});
  }
  at.host = address.substr(0, colon);
}

OpenInstrument configure(TableReader& daq, std::vector<TableReader>& channels) {
  TcpAddress at;
  at.host = daq.text("host");
  at.port = static_cast<int>(daq.integer_or("port", at.port, {.at_least = 1, .at_most = 65535}));
  at.timeout_ms = static_cast<int>(
      daq.integer_or("timeout_ms", at.timeout_ms, {.at_least = 1, .at_most = most_timeout_ms}));
  const RegisterMap map = read_register_map(daq, channels);
  return [at, map](const OpenOptions& options) -> std::unique_ptr<Instrument> {
    TcpAddress opened = at;
    if (options.address) take_address(opened, *options.address);
    return open_modbus(map, std::make_unique<TcpLine>(opened, map.unit, options));
  };
}

}  // namespace

const Driver modbus_tcp_driver{"modbus-tcp", Line::tcp, configure};

}  // namespace diastole::daq
