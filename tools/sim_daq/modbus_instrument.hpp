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
// It does no waiting of its own: the owner waits for descriptors() to become readable, or for
// next_reply_ns(), and calls service(). Not thread-safe.

#include <modbus/modbus.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

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
  /// Told when an answer comes that much late, or (never_ns) not at all.
  std::function<Wait(uint64_t late_ns)> wait = [](uint64_t) { return Wait::goes_on; };
  static constexpr uint64_t never_ns = UINT64_MAX;
};

class ModbusInstrument {
 public:
  /// Starts to listen. Throws HardwareError when the address cannot be bound.
  ModbusInstrument(const InstrumentConfig& config, InstrumentInputs inputs);
  ~ModbusInstrument();
  ModbusInstrument(const ModbusInstrument&) = delete;
  ModbusInstrument& operator=(const ModbusInstrument&) = delete;

  [[nodiscard]] uint16_t port() const { return port_; }
  /// What is wrong with it; may be changed at any time.
  [[nodiscard]] DaqFaults& faults() { return config_.faults; }

  /// The listening socket and the clients', to wait for.
  [[nodiscard]] std::vector<int> descriptors() const;
  /// Accepts and answers what has arrived, and sends the delayed replies that are due. Never waits.
  void service();
  /// When the next delayed reply is due, on the clock of now_ns.
  [[nodiscard]] std::optional<uint64_t> next_reply_ns() const;

 private:
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

  void accept_client();
  /// False when the client has gone.
  bool receive_from(int client);
  void drop(int client);
  /// False when the client is to be dropped.
  bool answer(int client, const Request& request);
  modbus_mapping_t* registers_at(int address);

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
