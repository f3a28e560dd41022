#pragma once
// A simulated analog-input instrument that answers Modbus TCP with the register map of a LabJack T-series
// device:
//
//   address        type      holds
//   2 n            FLOAT32   AIN#n in volts, two registers, most significant first; n = 0 ... channels - 1
//   55100          UINT32    TEST, always 0x00112233
//   61520          UINT32    CORE_TIMER, counts at 40 MHz (times 1 + clock_error_ppm * 1e-6), wraps
//
// All are read as holding (function 3) or as input registers (function 4); any other address is answered with
// exception 2 (illegal data address). One request is answered from one instant.
//
// It does no waiting of its own: the owner waits for descriptors() to become readable, a moment at most (replies may be
// delayed), and calls service(). Not thread-safe.

#include <arpa/inet.h>
#include <fmt/format.h>
#include <modbus/modbus.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "protocol/contract/input_error.hpp"

namespace diastole::sim_daq {

/// Half-open span of time; empty by default.
struct FaultWindow {
  static FaultWindow always() { return {0, std::numeric_limits<uint64_t>::max()}; }
  uint64_t from_ns = std::numeric_limits<uint64_t>::max();
  uint64_t until_ns = std::numeric_limits<uint64_t>::max();
  [[nodiscard]] bool holds(uint64_t now_ns) const { return now_ns >= from_ns && now_ns < until_ns; }
};

/// What can be wrong with it, and when; times on its own clock.
struct DaqFaults {
  FaultWindow stall{};  ///< requests are swallowed
  FaultWindow drop{};   ///< connections are closed, new ones closed at once
  FaultWindow delay{};  ///< replies come delay_ns late
  uint64_t delay_ns = 0;
  bool refuse = false;       ///< answers with exception 11: the target device failed to respond
  bool cut_short = false;    ///< sends half an answer, then closes the connection
  bool stuck = false;        ///< the inputs' registers keep their values
  double timer_ahead_s = 0;  ///< of CORE_TIMER
};

struct InstrumentConfig {
  std::string address = "127.0.0.1";
  uint16_t port = 0;  ///< 0: any free one
  int channels = 14;
  double clock_error_ppm = 0;
  DaqFaults faults{};
};

/// What becomes of a client that waits for a late answer.
enum class Wait {
  goes_on,   ///< time passes by itself
  is_over,   ///< the time was let pass
  given_up,  ///< it has waited for as long as it would
};

/// Where the instrument gets the time and its inputs from. The time never decreases.
struct InstrumentInputs {
  std::function<uint64_t()> now_ns;
  std::function<double(int channel)> volts;  ///< at now_ns()
  /// Asked once before the inputs are read: whether this reading fails, with exception 11.
  std::function<bool()> reading_fails = [] { return false; };
  /// Called when an answer comes that much late, or (never_ns) not at all.
  std::function<Wait(uint64_t late_ns)> wait = [](uint64_t) { return Wait::goes_on; };
  static constexpr uint64_t never_ns = UINT64_MAX;
};

class ModbusInstrument {
 public:
  /// Starts to listen. Throws HardwareError when the address cannot be bound.
  ModbusInstrument(const InstrumentConfig& config, InstrumentInputs inputs)
      : config_(config),
        inputs_(std::move(inputs)),
        context_(modbus_new_tcp(config.address.c_str(), config.port)),
        analog_(new_registers(0, 2 * config.channels)),
        test_(new_registers(test_address, 2)),
        timer_(new_registers(core_timer_address, 2)) {
    listener_ = modbus_tcp_listen(context_.get(), queued_connections);
    if (listener_ < 0) {
      throw HardwareError(fmt::format("{}:{}", config.address, config.port),
                          fmt::format("cannot listen here for Modbus TCP: {}", modbus_strerror(errno)),
                          "Choose another port, or 0 for any free one.");
    }
    port_ = bound_port(listener_);
    put_u32(*test_, 0, test_value);
  }
  ~ModbusInstrument() {
    for (const int client : clients_)
      ::close(client);
    ::close(listener_);
  }
  ModbusInstrument(const ModbusInstrument&) = delete;
  ModbusInstrument& operator=(const ModbusInstrument&) = delete;

  [[nodiscard]] uint16_t port() const { return port_; }
  /// What is wrong with it; may be changed at any time.
  [[nodiscard]] DaqFaults& faults() { return config_.faults; }

  /// The listening socket and the clients', to wait for.
  [[nodiscard]] std::vector<int> descriptors() const {
    std::vector<int> list{listener_};
    list.insert(list.end(), clients_.begin(), clients_.end());
    return list;
  }
  /// Accepts and answers what has arrived, and sends the delayed replies that are due. Never waits.
  void service() {
    const uint64_t now_ns = inputs_.now_ns();
    if (config_.faults.drop.holds(now_ns)) {
      while (!clients_.empty())
        drop(clients_.back());
    }
    while (readable(listener_))
      accept_client();
    for (const int client : std::vector<int>(clients_)) {
      while (readable(client)) {
        if (!receive_from(client)) {
          drop(client);
          break;
        }
      }
    }
    while (!delayed_.empty() && delayed_.front().due_ns <= now_ns) {
      const Delayed reply = std::move(delayed_.front());
      delayed_.pop_front();
      if (!answer(reply.client, reply.request)) drop(reply.client);
    }
  }

 private:
  static constexpr int test_address = 55100;
  static constexpr int core_timer_address = 61520;
  static constexpr uint32_t test_value = 0x00112233;
  static constexpr int queued_connections = 8;

  static modbus_mapping_t* new_registers(int start, int count) {
    const auto s = static_cast<unsigned>(start);
    const auto n = static_cast<unsigned>(count);
    return modbus_mapping_new_start_address(0, 0, 0, 0, s, n, s, n);
  }

  /// Writes two registers, most significant first, so that functions 3 and 4 read the same.
  static void put_u32(modbus_mapping_t& registers, int index, uint32_t value) {
    for (uint16_t* table : {registers.tab_registers, registers.tab_input_registers}) {
      table[index] = static_cast<uint16_t>(value >> 16);
      table[index + 1] = static_cast<uint16_t>(value & 0xFFFF);
    }
  }

  static void put_float(modbus_mapping_t& registers, int index, float value) {
    put_u32(registers, index, std::bit_cast<uint32_t>(value));
  }

  static bool readable(int fd) {
    pollfd one{fd, POLLIN, 0};
    return ::poll(&one, 1, 0) > 0;
  }

  static uint16_t bound_port(int listener) {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
    return ntohs(address.sin_port);
  }

  using Request = std::vector<uint8_t>;
  struct Delayed {
    int client;
    uint64_t due_ns;
    Request request;
  };
  struct Free {
    void operator()(modbus_t* context) const { modbus_free(context); }
    void operator()(modbus_mapping_t* mapping) const { modbus_mapping_free(mapping); }
  };
  using Registers = std::unique_ptr<modbus_mapping_t, Free>;

  void accept_client() {
    const int client = modbus_tcp_accept(context_.get(), &listener_);
    if (client < 0) return;
    if (config_.faults.drop.holds(inputs_.now_ns())) {
      ::close(client);
      return;
    }
    clients_.push_back(client);
  }
  /// False when the client has gone.
  bool receive_from(int client) {
    modbus_set_socket(context_.get(), client);
    Request request(MODBUS_TCP_MAX_ADU_LENGTH);
    const int length = modbus_receive(context_.get(), request.data());
    if (length < 0) return false;
    request.resize(static_cast<size_t>(length));
    const uint64_t now_ns = inputs_.now_ns();
    if (config_.faults.stall.holds(now_ns)) return inputs_.wait(InstrumentInputs::never_ns) != Wait::given_up;
    if (!config_.faults.delay.holds(now_ns)) return answer(client, request);
    const uint64_t delay_ns = config_.faults.delay_ns;
    const Wait wait = inputs_.wait(delay_ns);
    if (wait == Wait::goes_on) delayed_.push_back({client, now_ns + delay_ns, std::move(request)});
    return wait == Wait::is_over ? answer(client, request) : wait == Wait::goes_on;
  }
  void drop(int client) {
    std::erase(clients_, client);
    std::erase_if(delayed_, [&](const Delayed& reply) { return reply.client == client; });
    ::close(client);
  }
  /// False when the client is to be dropped.
  bool answer(int client, const Request& request) {
    const auto at =
        static_cast<size_t>(modbus_get_header_length(context_.get())) + 1;  // after the function code
    if (request.size() < at + 2) return true;
    modbus_set_socket(context_.get(), client);
    if (config_.faults.cut_short) {
      const Request half(request.begin(), request.begin() + static_cast<std::ptrdiff_t>(at));
      (void)::send(client, half.data(), half.size(), MSG_NOSIGNAL);
      return false;
    }
    const int address = request[at] << 8 | request[at + 1];
    const bool inputs_asked = address < analog_->start_registers + analog_->nb_registers;
    if (config_.faults.refuse || (inputs_asked && inputs_.reading_fails())) {
      modbus_reply_exception(context_.get(), request.data(), MODBUS_EXCEPTION_GATEWAY_TARGET);
      return true;
    }
    modbus_reply(context_.get(), request.data(), static_cast<int>(request.size()), registers_at(address));
    return true;
  }
  modbus_mapping_t* registers_at(int address) {
    const auto is_in = [&](const Registers& registers) {
      return address >= registers->start_registers &&
             address < registers->start_registers + registers->nb_registers;
    };
    if (is_in(test_)) return test_.get();
    if (is_in(timer_)) {
      const double rate_Hz = 40e6 * (1 + config_.clock_error_ppm * 1e-6);
      const double time_s = static_cast<double>(inputs_.now_ns()) * 1e-9 + config_.faults.timer_ahead_s;
      const double ticks = std::floor(time_s * rate_Hz);
      put_u32(*timer_, 0, static_cast<uint32_t>(static_cast<uint64_t>(ticks)));
      return timer_.get();
    }
    for (int channel = 0; channel < config_.channels && !config_.faults.stuck; ++channel) {
      put_float(*analog_, 2 * channel, static_cast<float>(inputs_.volts(channel)));
    }
    return analog_.get();
  }

  InstrumentConfig config_;
  InstrumentInputs inputs_;
  std::unique_ptr<modbus_t, Free> context_;
  Registers analog_, test_, timer_;
  int listener_ = -1;
  uint16_t port_ = 0;
  std::vector<int> clients_;
  std::deque<Delayed> delayed_;
};

}  // namespace diastole::sim_daq
