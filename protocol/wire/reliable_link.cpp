#include "protocol/wire/reliable_link.hpp"

#include <algorithm>

namespace diastole::wire {

void ReliableLink::begin_session(std::uint16_t session, State state) {
  session_ = session;
  state_ = state;
  ++generation_;
  base_ = expected_ = 0;
  queued_ = sent_ = ever_sent_ = 0;
  waiting_datagrams_ = 0;
  gap_repaired_ = ack_due_ = false;
  closed_due_.reset();
}

void ReliableLink::open(std::uint16_t session, std::uint64_t now_us) {
  begin_session(session, State::opening);
  next_open_us_ = now_us;
}

void ReliableLink::close() { begin_session(session_, State::closed); }

bool ReliableLink::send(MessageType type, std::span<const std::uint8_t> payload) {
  if (delivery_of(type) == Delivery::datagram) return queue_datagram(type, payload);
  if (room() == 0 || payload.size() > kMaxPayloadBytes) return false;
  Slot& slot = slots_[(base_ + queued_) % kWindow];
  slot.type = static_cast<std::uint8_t>(type);
  slot.size = static_cast<std::uint8_t>(payload.size());
  std::copy(payload.begin(), payload.end(), slot.payload.begin());
  ++queued_;
  return true;
}

bool ReliableLink::queue_datagram(MessageType type, std::span<const std::uint8_t> payload) {
  if (state_ != State::open || payload.size() > kMaxDatagramBytes) return false;
  if (waiting_datagrams_ == kDatagramSlots) {
    first_datagram_ = (first_datagram_ + 1) % kDatagramSlots;
    --waiting_datagrams_;
    ++counters_.datagrams_dropped;
  }
  Datagram& datagram = datagrams_[(first_datagram_ + waiting_datagrams_) % kDatagramSlots];
  datagram.type = static_cast<std::uint8_t>(type);
  datagram.size = static_cast<std::uint8_t>(payload.size());
  std::copy(payload.begin(), payload.end(), datagram.payload.begin());
  ++waiting_datagrams_;
  return true;
}

std::optional<Received> ReliableLink::receive(std::uint8_t byte, std::uint64_t now_us) {
  const auto outcome = decoder_.push(byte);
  if (!outcome) return {};
  if (!outcome->ok()) {
    ++(outcome->error() == FrameFault::bad_crc ? counters_.crc_errors : counters_.framing_errors);
    return {};
  }
  ++counters_.frames_received;
  return accept(outcome->value(), now_us);
}

/// Handles sessions; true if the frame belongs to the open one and carries more.
bool ReliableLink::accept_session(const FrameHeader& header, std::uint64_t now_us) {
  const bool same = header.session == session_;
  if (role_ == Role::controller && header.kind == FrameKind::open) {
    if (!same || state_ != State::open) begin_session(header.session, State::open);
    last_heard_us_ = now_us;
    open_ack_due_ = true;
    return false;
  }
  if (role_ == Role::host && same && header.kind == FrameKind::open_ack) {
    if (state_ == State::opening) state_ = State::open;
    last_heard_us_ = now_us;
    return false;
  }
  if (role_ == Role::host && same && header.kind == FrameKind::closed) {
    if (state_ == State::open) state_ = State::lost;
    return false;
  }
  if (!same || state_ != State::open) {
    ++counters_.wrong_session;
    if (role_ == Role::controller && header.kind >= FrameKind::ack) closed_due_ = header.session;
    return false;
  }
  last_heard_us_ = now_us;
  return header.kind >= FrameKind::ack;
}

void ReliableLink::accept_ack(const FrameHeader& header, std::uint64_t now_us) {
  const auto confirmed = static_cast<std::size_t>(static_cast<std::uint8_t>(header.ack - base_));
  if (confirmed > ever_sent_) return;
  if (confirmed == 0) {
    if (header.kind == FrameKind::ack && ever_sent_ > 0 && !gap_repaired_) {
      go_back(now_us);
      gap_repaired_ = true;
    }
    return;
  }
  base_ = static_cast<std::uint8_t>(base_ + confirmed);
  queued_ -= confirmed;
  ever_sent_ -= confirmed;
  sent_ -= std::min(sent_, confirmed);
  progress_us_ = now_us;
  gap_repaired_ = false;
}

void ReliableLink::go_back(std::uint64_t now_us) {
  sent_ = 0;
  progress_us_ = now_us;
}

std::optional<Received> ReliableLink::accept(const Frame& frame, std::uint64_t now_us) {
  if (!accept_session(frame.header, now_us)) return {};
  accept_ack(frame.header, now_us);
  if (frame.header.kind == FrameKind::datagram)
    return Received{frame.header.type, Delivery::datagram, frame.payload};
  if (frame.header.kind != FrameKind::sequenced) return {};
  ack_due_ = true;
  const auto ahead = static_cast<std::uint8_t>(frame.header.seq - expected_);
  if (ahead != 0) {
    ++(ahead >= 128 ? counters_.duplicates : counters_.out_of_order);
    return {};
  }
  ++expected_;
  return Received{frame.header.type, Delivery::sequenced, frame.payload};
}

std::span<const std::uint8_t> ReliableLink::emit(FrameKind kind, std::uint16_t session, std::uint8_t type,
                                                 std::uint8_t seq, std::span<const std::uint8_t> payload) {
  ++counters_.frames_sent;
  return encode_frame({session, kind, type, seq, expected_}, payload, encoded_);
}

std::span<const std::uint8_t> ReliableLink::emit_control(std::uint64_t now_us) {
  if (open_ack_due_) {
    open_ack_due_ = false;
    return emit(FrameKind::open_ack, session_, 0, 0, {});
  }
  if (closed_due_) {
    const std::uint16_t stranger = *closed_due_;
    closed_due_.reset();
    return emit(FrameKind::closed, stranger, 0, 0, {});
  }
  if (state_ == State::opening && now_us >= next_open_us_) {
    next_open_us_ = now_us + options_.reopen_us;
    return emit(FrameKind::open, session_, 0, 0, {});
  }
  return {};
}

std::span<const std::uint8_t> ReliableLink::emit_sequenced(std::uint64_t now_us) {
  if (sent_ == queued_ && sent_ > 0 && now_us - progress_us_ >= options_.retransmit_us) {
    go_back(now_us);
    gap_repaired_ = false;
  }
  if (sent_ == queued_) return {};
  if (sent_ == 0) progress_us_ = now_us;
  const auto seq = static_cast<std::uint8_t>(base_ + sent_);
  const Slot& slot = slots_[seq % kWindow];
  if (sent_ < ever_sent_) ++counters_.retransmissions;
  ever_sent_ = std::max(ever_sent_, ++sent_);
  ack_due_ = false;
  return emit(FrameKind::sequenced, session_, slot.type, seq, std::span(slot.payload).first(slot.size));
}

std::span<const std::uint8_t> ReliableLink::transmit(std::uint64_t now_us) {
  if (const auto control = emit_control(now_us); !control.empty()) return control;
  if (state_ != State::open) return {};
  if (waiting_datagrams_ > 0) {
    const Datagram& datagram = datagrams_[first_datagram_];
    first_datagram_ = (first_datagram_ + 1) % kDatagramSlots;
    --waiting_datagrams_;
    return emit(FrameKind::datagram, session_, datagram.type, 0,
                std::span(datagram.payload).first(datagram.size));
  }
  if (const auto message = emit_sequenced(now_us); !message.empty()) return message;
  if (!ack_due_) return {};
  ack_due_ = false;
  return emit(FrameKind::ack, session_, 0, 0, {});
}

}  // namespace diastole::wire
