#include "firmware/boards/stm32f405/serial_port.hpp"

#include "firmware/boards/stm32f405/clocks.hpp"
#include "firmware/boards/stm32f405/registers.hpp"

namespace diastole::stm32 {

namespace {
constexpr std::uint32_t kOverrun = 1U << 3, kReceived = 1U << 5, kTransmitEmpty = 1U << 7;
constexpr std::uint8_t kFrameEnd = 0;  ///< protocol/wire/frame.hpp
constexpr std::uint32_t kReceiveInterrupt = 1U << 5, kTransmitInterrupt = 1U << 7;
}  // namespace

void SerialPort::start() {
  constexpr std::uint32_t kReceiver = 1U << 2, kTransmitter = 1U << 3, kUsartEnable = 1U << 13;
  usart3().BRR.write((kApb1_Hz + kBaud / 2) / kBaud);
  usart3().CR1.write(kUsartEnable | kReceiver | kTransmitter | kReceiveInterrupt);
  enable_interrupt(kUsart3, 2);
}

std::optional<std::uint8_t> SerialPort::read() {
  const std::uint8_t* byte = received_.front();
  if (byte == nullptr) return {};
  const std::uint8_t value = *byte;
  received_.pop();
  return value;
}

void SerialPort::write(std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes)
    sending_.push(byte);
  usart3().CR1.set(kTransmitInterrupt);
}

bool SerialPort::interrupt() {
  const std::uint32_t status = usart3().SR.read();
  bool frame_ends = false;
  if ((status & (kReceived | kOverrun)) != 0) {
    const auto byte = static_cast<std::uint8_t>(usart3().DR.read());
    if ((status & kReceived) != 0) received_.push(byte);
    frame_ends = byte == kFrameEnd;
  }
  if ((status & kTransmitEmpty) != 0) send_next();
  return frame_ends;
}

void SerialPort::send_next() {
  if (const std::uint8_t* byte = sending_.front()) {
    usart3().DR.write(*byte);
    sending_.pop();
  } else {
    usart3().CR1.clear(kTransmitInterrupt);
  }
}

}  // namespace diastole::stm32
