#include "protocol/wire/frame.hpp"

namespace diastole::wire {

namespace {

/// Stuffs bytes as they come; the whole frame is short enough that no block ever reaches 254 data bytes
/// without ending there.
class CobsWriter {
 public:
  explicit CobsWriter(std::span<std::uint8_t, kMaxEncodedBytes> out) : out_(out) {}
  void add(std::uint8_t byte) {
    if (byte == 0) {
      close_block();
      return;
    }
    out_[size_++] = byte;
  }
  std::span<const std::uint8_t> finish() {
    close_block();
    out_[block_] = 0;
    return out_.first(size_);
  }

 private:
  void close_block() {
    out_[block_] = static_cast<std::uint8_t>(size_ - block_);
    block_ = size_++;
  }
  std::span<std::uint8_t, kMaxEncodedBytes> out_;
  std::size_t block_ = 0;
  std::size_t size_ = 1;
};

}  // namespace

std::span<const std::uint8_t> encode_frame(const FrameHeader& header, std::span<const std::uint8_t> payload,
                                           std::span<std::uint8_t, kMaxEncodedBytes> out) {
  const std::array<std::uint8_t, kHeaderBytes> head{static_cast<std::uint8_t>(header.session),
                                                    static_cast<std::uint8_t>(header.session >> 8),
                                                    static_cast<std::uint8_t>(header.kind),
                                                    header.type,
                                                    header.seq,
                                                    header.ack};
  CobsWriter cobs(out);
  Crc32 crc;
  const auto add = [&](std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) {
      crc.add(byte);
      cobs.add(byte);
    }
  };
  add(head);
  add(payload);
  for (unsigned shift = 0; shift < 32; shift += 8)
    cobs.add(static_cast<std::uint8_t>(crc.value() >> shift));
  return cobs.finish();
}

std::optional<Result<Frame, FrameFault>> FrameDecoder::push(std::uint8_t byte) {
  if (byte == 0) {
    if (!started_) return {};
    const auto outcome = finish();
    restart();
    return outcome;
  }
  if (left_in_block_ == 0) {
    if (zero_due_) store(0);
    left_in_block_ = static_cast<std::uint8_t>(byte - 1);
    zero_due_ = byte != 0xFF;
    started_ = true;
    return {};
  }
  --left_in_block_;
  store(byte);
  return {};
}

void FrameDecoder::store(std::uint8_t byte) {
  if (size_ < plain_.size())
    plain_[size_++] = byte;
  else
    too_long_ = true;
}

void FrameDecoder::restart() {
  size_ = 0;
  left_in_block_ = 0;
  started_ = zero_due_ = too_long_ = false;
}

std::optional<Result<Frame, FrameFault>> FrameDecoder::finish() {
  using Outcome = Result<Frame, FrameFault>;
  if (too_long_) return Outcome(FrameFault::too_long);
  if (left_in_block_ != 0 || size_ < kHeaderBytes + kCrcBytes) return Outcome(FrameFault::truncated);
  const std::size_t crc_at = size_ - kCrcBytes;
  std::uint32_t sent = 0;
  for (std::size_t i = kCrcBytes; i-- > 0;)
    sent = (sent << 8) | plain_[crc_at + i];
  if (crc32(std::span(plain_).first(crc_at)) != sent) return Outcome(FrameFault::bad_crc);
  if (plain_[2] > static_cast<std::uint8_t>(FrameKind::sequenced)) return Outcome(FrameFault::bad_kind);
  Frame frame;
  frame.header = {static_cast<std::uint16_t>(plain_[0] | plain_[1] << 8), static_cast<FrameKind>(plain_[2]),
                  plain_[3], plain_[4], plain_[5]};
  frame.payload = std::span<const std::uint8_t>(plain_).subspan(kHeaderBytes, crc_at - kHeaderBytes);
  return Outcome(frame);
}

}  // namespace diastole::wire
