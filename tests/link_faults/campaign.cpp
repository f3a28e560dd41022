#include "tests/link_faults/campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "protocol/wire/messages.hpp"
#include "protocol/wire/reliable_link.hpp"

namespace diastole::link_faults {
namespace {

using wire::MessageType;
using wire::ReliableLink;
using Payload = std::array<std::uint8_t, wire::kMaxPayloadBytes>;

struct Message {
  MessageType type{};
  Payload memory{};
  std::span<const std::uint8_t> bytes;
};

/// Command or report number `number`: its content tells the number, its size varies.
template <class Kind>
void put(Message& message, const Kind& kind) {
  message.type = Kind::kType;
  message.bytes = wire::encode(kind, message.memory);
}

void make_command(std::uint32_t number, Message& message) {
  const auto id = static_cast<std::uint16_t>(number);
  switch (number % 4) {
    case 0: {
      wire::Configure configure = wire::Configure::example();
      configure.request_id = id;
      configure.travel_uL = 1 + number % 50'000'000;
      return put(message, configure);
    }
    case 1:
      return put(message, wire::StopNow{id});
    default:
      return put(message, wire::AddSegment{id, static_cast<wire::Waveform>(number % 6), 1 + number % 1000,
                                           number, number * 7, 300'000 + number % 1'000'000});
  }
}

void make_report(std::uint32_t number, Message& message) {
  if (number % 16 == 0) {
    wire::PositionBatch batch;
    batch.first_index = number;
    batch.period_ticks = 280'000;
    batch.count = 30;
    std::fill_n(batch.position_microsteps.begin(), 30, static_cast<std::int32_t>(number * 2'654'435'761U));
    return put(message, batch);
  }
  put(message,
      wire::Trigger{number, std::uint64_t{number} * 84'000'000, static_cast<std::uint8_t>(number % 2), 1});
}

/// One end: sends messages in order, expects the other's in order.
struct End {
  using Maker = void (*)(std::uint32_t, Message&);
  ReliableLink link;
  Maker sends, expects;
  std::uint32_t sent = 0, received_count = 0;
  std::uint64_t wrong = 0;

  void fill() {
    for (Message message; link.room() > 0; ++sent) {
      sends(sent, message);
      if (!link.send(message.type, message.bytes)) return;
    }
  }
  void take(std::span<const std::uint8_t> bytes, std::uint64_t now_us) {
    for (const std::uint8_t byte : bytes) {
      const auto received = link.receive(byte, now_us);
      if (!received || received->delivery == wire::Delivery::datagram) continue;
      Message expected;
      expects(received_count++, expected);
      const bool same = received->type == static_cast<std::uint8_t>(expected.type) &&
                        std::ranges::equal(received->payload, expected.bytes);
      wrong += same ? 0 : 1;
    }
  }
};

class Campaign {
 public:
  explicit Campaign(const CampaignOptions& options)
      : options_(options), down_({}, options.seed), up_({}, options.seed + 1'000'003) {}

  CampaignReport run() {
    host_.link.open(static_cast<std::uint16_t>(options_.seed), now_us_);
    while (host_.link.state() != ReliableLink::State::open)
      turn(false);
    while (frames() < options_.frames) {
      set_rates(options_.rates);
      for (std::uint64_t ms = 0; ms < options_.bad_ms; ++ms)
        turn(true);
      if (options_.forge_a_command) forge();
      set_rates({});
      recover();
    }
    return report();
  }

 private:
  void set_rates(const FaultRates& rates) {
    down_.set_rates(rates);
    up_.set_rates(rates);
  }
  [[nodiscard]] std::uint64_t frames() const { return down_.counts().frames + up_.counts().frames; }

  void turn(bool busy) {
    now_us_ += 1000;
    if (busy) {
      host_.fill();
      controller_.fill();
    }
    if (now_us_ % 50'000 == 0) {
      Payload memory{};
      (void)host_.link.send(MessageType::Heartbeat, wire::encode(wire::Heartbeat{0x5EA5E}, memory));
    }
    send(host_.link, down_);
    send(controller_.link, up_);
    controller_.take(down_.take(now_us_), now_us_);
    host_.take(up_.take(now_us_), now_us_);
  }
  void send(ReliableLink& link, LineFaults& line) const {
    for (auto bytes = link.transmit(now_us_); !bytes.empty(); bytes = link.transmit(now_us_))
      line.push(bytes, now_us_);
  }

  /// A good line: everything handed over must come through.
  void recover() {
    std::uint64_t ms = 0;
    for (; ms < 2'000 && !(host_.link.idle() && controller_.link.idle()); ++ms)
      turn(false);
    worst_recovery_ms_ = std::max(worst_recovery_ms_, ms);
  }

  void forge() {
    Message message;
    make_command(controller_.received_count + 4, message);
    std::array<std::uint8_t, wire::kMaxEncodedBytes> encoded{};
    const wire::FrameHeader header{host_.link.session(), wire::FrameKind::sequenced,
                                   static_cast<std::uint8_t>(message.type),
                                   static_cast<std::uint8_t>(controller_.received_count), 0};
    const std::uint8_t end = 0;
    controller_.take({&end, 1}, now_us_);
    controller_.take(wire::encode_frame(header, message.bytes, encoded), now_us_);
  }

  [[nodiscard]] CampaignReport report() const {
    CampaignReport found;
    for (const FaultCounts* counts : {&down_.counts(), &up_.counts()}) {
      found.line.frames += counts->frames;
      found.line.damaged += counts->damaged;
      found.line.bits_flipped += counts->bits_flipped;
      found.line.bytes_lost += counts->bytes_lost;
      found.line.lost += counts->lost;
      found.line.repeated += counts->repeated;
      found.line.reordered += counts->reordered;
      found.line.truncated += counts->truncated;
    }
    for (const End* end : {&host_, &controller_}) {
      const wire::LinkCounters& counters = end->link.counters();
      found.resent += counters.retransmissions;
      found.rejected += counters.crc_errors + counters.framing_errors;
      found.wrong += end->wrong;
    }
    found.commands = controller_.received_count;
    found.telemetry = host_.received_count;
    found.missing = (host_.sent - std::min(host_.sent, controller_.received_count)) +
                    (controller_.sent - std::min(controller_.sent, host_.received_count));
    found.worst_recovery_ms = worst_recovery_ms_;
    return found;
  }

  const CampaignOptions& options_;
  End host_{ReliableLink(ReliableLink::Role::host), make_command, make_report};
  End controller_{ReliableLink(ReliableLink::Role::controller), make_report, make_command};
  LineFaults down_, up_;
  std::uint64_t now_us_ = 1'000'000;
  std::uint64_t worst_recovery_ms_ = 0;
};

}  // namespace

CampaignReport run_campaign(const CampaignOptions& options) { return Campaign(options).run(); }

std::string table_head() {
  return fmt::format("{:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>8} {:>6} {:>8}\n", "bit error",
                     "frames", "damaged", "lost", "repeated", "reordered", "resent", "commands", "telemetry",
                     "recov/ms", "wrong", "missing");
}

std::string table_row(const CampaignOptions& options, const CampaignReport& report) {
  return fmt::format("{:>9.0e} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>8} {:>6} {:>8}\n",
                     options.rates.bit_error, report.line.frames, report.line.damaged, report.line.lost,
                     report.line.repeated, report.line.reordered, report.resent, report.commands,
                     report.telemetry, report.worst_recovery_ms, report.wrong, report.missing);
}

}  // namespace diastole::link_faults
