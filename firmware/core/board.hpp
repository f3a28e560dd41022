#pragma once
// What the core asks of the board it runs on, as a concept: the recording board of the host and the STM32F405
// each provide it, nothing is virtual on the interrupt path.

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/core/black_box.hpp"
#include "firmware/core/crash_record.hpp"
#include "firmware/core/r_wave.hpp"
#include "firmware/core/units.hpp"
#include "protocol/wire/image_header.hpp"
#include "protocol/wire/self_test_messages.hpp"
#include "protocol/wire/states.hpp"
#include "protocol/wire/update.hpp"

namespace diastole::firmware {

/// Edges to be made by the timer's compare unit when the clock reaches `tick`, whatever software does then.
struct PulseOrder {
  std::uint32_t tick = 0;  ///< lower half of the clock; less than 25 s ahead
  bool step = false;       ///< STEP rises, and falls kStepPulse later
  bool inflate = false;    ///< DIR, set kDirectionSetup before the step when it changes
  bool ttl = false;        ///< TTL rises, and falls ttl_width later
  bool r_wave = false;     ///< the R-wave (r_wave.hpp) starts
  Ticks ttl_width;
};

inline constexpr Ticks kStepPulse = microseconds(2);
inline constexpr Ticks kDirectionSetup = microseconds(5);

struct Inputs {
  bool estop = false;  ///< pressed, or its loop is broken
  bool home = false;
  bool far_limit = false;
};

struct Identity {
  std::uint16_t board_id = 0;
  std::uint32_t boot_id = 0;
  wire::ResetCause reset_cause = wire::ResetCause::unknown;
};

/// The image that the board runs, among those in its slots.
struct RunningImage {
  wire::ImageSlot slot = wire::ImageSlot::a;
  wire::ImageState state = wire::ImageState::unrecorded;
  wire::FirmwareVersion version;
  std::uint64_t build_id = 0;
  std::uint32_t code_bytes = 0;
  std::uint32_t link_address = 0;
};

template <class B>
concept Board = requires(B& board, const B& fixed, const PulseOrder& order,
                         std::span<const std::uint8_t> bytes) {
  { fixed.now() } -> std::same_as<Ticks>;
  /// From now to the lower half of a time within 25 s; negative if that has passed.
  { fixed.ticks_until(std::uint32_t{}) } -> std::same_as<std::int32_t>;
  /// One order at a time: the board calls Controller::on_match() when this one has been carried out.
  {board.schedule(order)};
  /// TTL rises at a tick less than 25 s ahead, without an order, and falls a width later; with or without the R-wave.
  /// Precondition: the TTL before has fallen, its R-wave is over, and the next order is none with a TTL.
  {board.schedule_trigger(std::uint32_t{}, Ticks{}, true)};
  /// When the TTL that was ordered for this tick rose, by what saw the pin and not by the order; nothing if it did not.
  /// Asked once, from the tick on until the next TTL is ordered.
  { fixed.ttl_rise(std::uint32_t{}) } -> std::same_as<std::optional<std::uint32_t>>;
  /// No order follows the one carried out: no edge until the next schedule().
  {board.rest()};
  /// STEP and TTL do not rise from this moment on; a STEP that is high falls in time, the TTL at once. Callable
  /// from any interrupt.
  {board.cancel_pulses()};
  /// From now on; at rest only.
  {board.use_signals(SignalSettings{})};
  {board.set_motor_enabled(true)};
  {board.show_fault(std::uint8_t{})};
  /// The board calls Controller::on_inputs() when one of them changes.
  { fixed.inputs() } -> std::same_as<Inputs>;
  { fixed.identity() } -> std::same_as<Identity>;
  { board.serial_read() } -> std::same_as<std::optional<std::uint8_t>>;
  { fixed.serial_room() } -> std::same_as<std::size_t>;
  /// Precondition: bytes.size() <= serial_room().
  {board.serial_write(bytes)};
  {board.feed_watchdog()};
  /// Whether the clock runs from the crystal that its rate comes from.
  { fixed.clock_sound() } -> std::same_as<bool>;
  /// Whether flash may be erased and programmed at the present supply.
  { fixed.supply_sound() } -> std::same_as<bool>;
  /// Memory that outlives a reset, though not a loss of power; arbitrary then.
  { board.retained() } -> std::same_as<BlackBox::Memory&>;
  /// Of the processor fault that ended the start before, once.
  { board.take_crash() } -> std::same_as<std::optional<CrashRecord>>;
  /// Where settings are kept (settings_store.hpp); writing there may hold everything up for a second.
  { board.settings_flash() } -> std::same_as<typename B::SettingsFlash&>;
  { fixed.running_image() } -> std::same_as<RunningImage>;
  /// Whether the bootloader has no key, and so anybody's firmware is taken.
  { fixed.takes_unsigned_firmware() } -> std::same_as<bool>;
  /// Makes the running image the one to start from now on; at rest only. False: the flash did not take it.
  { board.confirm_image() } -> std::same_as<bool>;
  /// One measurement over loop-back wires, without answering the line for up to 50 ms; pins, position and counters are
  /// afterwards as before. Precondition: nothing moves or is scheduled, and the motor has no current.
  { board.self_test(wire::SelfTest{}) } -> std::same_as<wire::SelfTestReport>;
  /// Resets, into the bootloader if asked. Outputs must be safe.
  {board.restart(true)};
  /// Interrupts that call the core are held off while one of these lives.
  typename B::InterruptLock;
  requires std::constructible_from<typename B::InterruptLock, B&>;
};

}  // namespace diastole::firmware
