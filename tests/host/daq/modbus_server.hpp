#pragma once
// A small Modbus TCP server for tests: two registers a channel (float32), a timer, an identity; it can stall,
// answer late and hang up when told.

#include <modbus/modbus.h>

#include <atomic>
#include <functional>
#include <thread>

namespace diastole {

class ModbusServer {
 public:
  enum class Mishap { none, stall, hang_up };

  /// `delay_ms` is how long an answer takes, and `mishap` what happens instead, by request number from 0.
  explicit ModbusServer(
      std::function<int(int request)> delay_ms = [](int) { return 0; },
      std::function<Mishap(int request)> mishap = [](int) { return Mishap::none; });
  ~ModbusServer();
  ModbusServer(const ModbusServer&) = delete;
  ModbusServer& operator=(const ModbusServer&) = delete;

  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] int connections() const { return connections_; }

 private:
  void serve(const std::stop_token& stop);
  void serve_client(int client, const std::stop_token& stop);
  void fill_registers(int request);

  std::function<int(int)> delay_ms_;
  std::function<Mishap(int)> mishap_;
  modbus_t* context_ = nullptr;
  modbus_mapping_t* registers_ = nullptr;
  int listener_ = -1;
  int port_ = 0;
  int requests_ = 0;
  std::atomic<int> connections_ = 0;
  std::jthread thread_;
};

}  // namespace diastole
