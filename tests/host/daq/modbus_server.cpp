#include "tests/host/daq/modbus_server.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <chrono>
#include <cstdint>

namespace diastole {
namespace {

constexpr int poll_ms = 10;

bool readable(int descriptor) {
  pollfd state{descriptor, POLLIN, 0};
  return ::poll(&state, 1, poll_ms) > 0;
}

}  // namespace

ModbusServer::ModbusServer(std::function<int(int)> delay_ms, std::function<Mishap(int)> mishap)
    : delay_ms_(std::move(delay_ms)), mishap_(std::move(mishap)) {
  context_ = modbus_new_tcp("127.0.0.1", 0);
  registers_ = modbus_mapping_new(0, 0, 65535, 0);
  listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  ::listen(listener_, 4);
  socklen_t size = sizeof(address);
  ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
  port_ = ntohs(address.sin_port);
  thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop); });
}

ModbusServer::~ModbusServer() {
  thread_.request_stop();
  thread_.join();
  ::close(listener_);
  modbus_mapping_free(registers_);
  modbus_free(context_);
}

void ModbusServer::serve(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    if (!readable(listener_)) continue;
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    ++connections_;
    serve_client(client, stop);
    ::close(client);
  }
}

void ModbusServer::serve_client(int client, const std::stop_token& stop) {
  modbus_set_socket(context_, client);
  std::array<uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> query{};
  while (!stop.stop_requested()) {
    if (!readable(client)) continue;
    const int length = modbus_receive(context_, query.data());
    if (length <= 0) return;
    const int request = requests_++;
    const Mishap mishap = mishap_(request);
    if (mishap == Mishap::hang_up) return;
    if (mishap == Mishap::stall) continue;
    fill_registers(request);
    std::this_thread::sleep_for(std::chrono::milliseconds(delay_ms_(request)));
    modbus_reply(context_, query.data(), length, registers_);
  }
}

/// Channel n reads request number + n / 10 volts, so that an answer tells to which question it belongs.
void ModbusServer::fill_registers(int request) {
  for (int channel = 0; channel < 4; ++channel) {
    const auto bits =
        std::bit_cast<uint32_t>(static_cast<float>(request) + 0.1F * static_cast<float>(channel));
    registers_->tab_registers[2 * channel] = static_cast<uint16_t>(bits >> 16U);
    registers_->tab_registers[2 * channel + 1] = static_cast<uint16_t>(bits);
  }
  registers_->tab_registers[55100] = 0x0011;
  registers_->tab_registers[55101] = 0x2233;
  registers_->tab_registers[61520] = 0x0001;
  registers_->tab_registers[61521] = static_cast<uint16_t>(request);
  registers_->tab_registers[100] = 1000;
  registers_->tab_registers[101] = static_cast<uint16_t>(-1000);
}

}  // namespace diastole
