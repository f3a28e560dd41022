#pragma once
// A host in miniature for tests: speaks the real protocol with the firmware on the recording board, over a
// line that may be cut or corrupted, and keeps everything it hears.

#include <functional>
#include <random>
#include <vector>

#include "firmware/boards/recording/recorded_controller.hpp"
#include "protocol/wire/messages.hpp"
#include "protocol/wire/reliable_link.hpp"
#include "tests/link_faults/line_faults.hpp"

namespace diastole::firmware {

/// An answer to a request: Ack, Hello and Status refuse nothing.
struct Answer {
  std::uint16_t request_id = 0;
  wire::Refusal refusal = wire::Refusal::none;
  bool operator==(const Answer&) const = default;
};

struct Heard {
  std::vector<Answer> answers;  ///< in order
  std::vector<wire::Hello> hellos;
  std::vector<wire::Ack> acks;
  std::vector<wire::Nak> naks;
  std::vector<wire::Status> statuses;
  std::vector<wire::SettingsReport> settings;
  std::vector<wire::BlackBoxReport> black_box;
  std::vector<wire::UpdateAnswer> updates;
  std::vector<wire::ImageReport> images;
  std::vector<wire::SegmentPlanned> planned;
  std::vector<wire::StateChanged> states;
  std::vector<wire::RunStarted> started;
  std::vector<wire::SegmentStarted> segments;
  std::vector<wire::Trigger> triggers;
  std::vector<wire::RunEnded> ended;
  std::vector<wire::FaultRaised> faults;
  std::vector<std::int32_t> positions;
  std::vector<std::uint64_t> position_ticks;
  bool positions_contiguous = true;
  std::size_t undecodable = 0;
};

class Bench {
 public:
  static constexpr std::uint32_t kLease = 0x5EA5E;

  explicit Bench(RecordedController::Options options = {}) : rig(options) {}

  /// Opens a session and says hello.
  void connect();
  /// connect, configure, home; leaves the controller homed.
  void prepare(const wire::Configure& configure = wire::Configure::example());
  /// Queues a request (request_id is filled in).
  template <class Request>
  void request(Request message) {
    if constexpr (requires { message.request_id; }) message.request_id = ++last_request_;
    std::array<std::uint8_t, wire::kMaxPayloadBytes> payload{};
    while (!link.send(Request::kType, wire::encode(message, payload)))
      run_for(microseconds(5'000));
  }
  /// request and wait for Ack (true) or Nak (false).
  template <class Request>
  bool ask(const Request& message) {
    const std::size_t acks = heard.acks.size(), naks = heard.naks.size();
    request(message);
    run_until([&] { return heard.acks.size() > acks || heard.naks.size() > naks; }, microseconds(3'000'000));
    return heard.acks.size() > acks;
  }
  void add_segment(wire::Waveform waveform, std::uint32_t cycles, std::uint32_t stroke_nL,
                   std::uint32_t period_us, std::uint32_t offset_nL = 0, std::uint8_t upload = 0);
  /// Uploads a waveform in lots; true if every one was accepted.
  bool upload(std::uint8_t number, std::span<const std::int16_t> rises);
  /// Arms, starts, and runs until RunEnded or `most`.
  void run_program(wire::Arm arm = wire::Arm::example(), Ticks most = microseconds(600'000'000));

  void run_for(Ticks time);
  bool run_until(const std::function<bool()>& done, Ticks most);

  /// The request_id of the last request.
  [[nodiscard]] std::uint16_t last_request() const { return last_request_; }
  [[nodiscard]] wire::State state() const { return rig.controller().motion().safety().state(); }

  RecordedController rig;
  wire::ReliableLink link{wire::ReliableLink::Role::host};
  Heard heard;
  bool heartbeats = true;
  bool cable = true;
  link_faults::LineFaults to_controller{{}, 1}, to_host{{}, 2};
  std::mt19937 random{1};

 private:
  void turn();
  void hear(const wire::Received& received);
  [[nodiscard]] std::uint64_t now_us() const { return on_wire(rig.now()) / 84; }

  std::uint16_t last_request_ = 0;
  Ticks next_heartbeat_;
};

}  // namespace diastole::firmware
