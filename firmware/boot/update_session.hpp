#pragma once
// An update as the bootloader carries it out: begin, data in order, finish. Whatever interrupts it, the slot
// shows how far it came: the header says of which image, the last written word how much. An erase that was cut off leaves
// cells that read as erased and are not, so its beginning and its end are recorded: in between the slot is erased again.

#include <optional>

#include "firmware/boot/slot_store.hpp"
#include "protocol/wire/update_messages.hpp"

namespace diastole::boot {

/// How a request ended; `value` is what the outcome speaks of (update_outcome_list.inc).
struct UpdateReply {
  wire::UpdateOutcome outcome = wire::UpdateOutcome::done;
  std::uint32_t value = 0;
};

template <SlotStore S>
class UpdateSession {
 public:
  explicit UpdateSession(S& store) : store_(store) {}

  /// Keeps what the free slot holds of this image, or erases it; writes the header.
  UpdateReply begin(const wire::BeginUpdate& request);
  UpdateReply add(const wire::UpdateData& data);
  /// Reads the image back; if it verifies, it is recorded as installed: the next start tries it.
  UpdateReply finish();

  [[nodiscard]] std::uint32_t held_bytes() const { return held_; }

 private:
  /// Fewer free records than this, and the sector is erased while nothing depends on it.
  static constexpr std::size_t kRecordsNeeded = 16;
  static constexpr std::size_t kRecordsOfAnUpdate = 4;  ///< installed, tried, confirmed, raised

  UpdateReply refuse(wire::UpdateOutcome outcome, std::uint32_t value = 0) {
    image_.reset();
    return {outcome, value};
  }
  [[nodiscard]] UpdateReply judge(const wire::ImageHeader& header, bool allow_older) const;
  [[nodiscard]] UpdateReply judge_signature(wire::SignedHeader header, const BootDecision& decision) const;
  [[nodiscard]] bool still_erased() const {
    return last_of_slot(store_.records(), slot_) == BootEvent::erased && is_erased(store_.slot(slot_));
  }
  bool prepare_slot();
  bool compact_records(const BootDecision& decision);

  S& store_;
  wire::ImageSlot slot_ = wire::ImageSlot::none;
  std::optional<wire::ImageHeader> image_;  ///< between begin and finish
  std::uint32_t held_ = 0;
};

template <SlotStore S>
UpdateReply UpdateSession<S>::judge(const wire::ImageHeader& header, bool allow_older) const {
  using enum wire::UpdateOutcome;
  const std::size_t slot_bytes = store_.slot(slot_).size();
  const wire::UpdateOutcome problem = fits(header, store_.board_id(), store_.slot_address(slot_), slot_bytes);
  if (problem == wrong_board) return {problem, store_.board_id()};
  if (problem == wrong_slot) return {problem, store_.slot_address(slot_)};
  if (problem == too_long) return {problem, static_cast<std::uint32_t>(slot_bytes - wire::kImageHeaderArea)};
  if (problem != done) return {problem, 0};
  const wire::ImageSlot other = slot_ == wire::ImageSlot::a ? wire::ImageSlot::b : wire::ImageSlot::a;
  const auto present = header_in(store_.slot(other));
  if (!allow_older && present && inspect(store_, other).verified && header.version < present->version)
    return {older_version, wire::packed(present->version)};
  return {};
}

template <SlotStore S>
UpdateReply UpdateSession<S>::judge_signature(wire::SignedHeader header, const BootDecision& decision) const {
  const std::uint32_t counter = rollback_counter(store_, decision);
  const wire::UpdateOutcome outcome = check_signature(store_, header, counter);
  return {outcome, outcome == wire::UpdateOutcome::rolled_back ? counter : 0};
}

template <SlotStore S>
UpdateReply UpdateSession<S>::begin(const wire::BeginUpdate& request) {
  using enum wire::UpdateOutcome;
  held_ = 0;
  if (request.header_bytes != wire::kImageHeaderBytes && request.header_bytes != request.header.size())
    return refuse(malformed);
  const wire::SignedHeader sent(request.header);
  const auto header = wire::decode_image_header(sent.first<wire::kImageHeaderBytes>());
  if (!header) return refuse(bad_header);
  const BootDecision decision = decide(store_);
  slot_ = decision.free;
  UpdateReply judged = judge(*header, request.allow_older != 0);
  if (judged.outcome == done) judged = judge_signature(sent, decision);
  if (judged.outcome != done) return refuse(judged.outcome, judged.value);
  if (!store_.supply_sound()) return refuse(supply_low);
  const std::span sent_header = std::span(request.header).first(request.header_bytes);
  if (std::equal(sent_header.begin(), sent_header.end(), store_.slot(slot_).begin()) &&
      !erase_interrupted(store_.records(), slot_)) {
    held_ = held_code(store_.slot(slot_), header->code_bytes);
  } else if (!prepare_slot()) {
    return refuse(flash_failed, 0);
  }
  // The header last: where there is one, its signature is whole. Also over one that stands: a cut may have hit its writing,
  // and cells that read as they should may not be so.
  if (!store_.write_slot(slot_, wire::kImageSignatureAt, sent_header.subspan(wire::kImageSignatureAt)) ||
      !store_.write_slot(slot_, 0, sent_header.first(wire::kImageHeaderBytes)))
    return refuse(flash_failed, 0);
  image_ = header;
  return {};
}

template <SlotStore S>
bool UpdateSession<S>::prepare_slot() {
  // A sector of records whose own erase was cut off has no whole record at its beginning, which is written last.
  const bool records_sound = decode_record(store_.records().template first<kRecordBytes>()).has_value();
  if (!still_erased()) {
    (void)append(store_, {BootEvent::erase_begun, slot_, {}});
    if (!store_.erase_slot(slot_)) return false;
    (void)append(store_, {BootEvent::erased, slot_, {}});
  }
  const bool compacted = !records_sound || records_left(store_.records()) < kRecordsNeeded;
  return !compacted || compact_records(decide(store_));
}

/// Precondition: the free slot is erased. Then only one image is left to start, whatever the records say: they
/// may be lost in the middle of this. Its signature holds the rollback counter meanwhile, and if it is confirmed until the next
/// start records it; without such an image a counter is not erased, but the last cells are used up.
template <SlotStore S>
bool UpdateSession<S>::compact_records(const BootDecision& decision) {
  const std::uint32_t counter = recorded_counter(store_.records());
  if (decision.keep == wire::ImageSlot::none && counter > 0)
    return records_left(store_.records()) >= kRecordsOfAnUpdate;
  if (!store_.erase_records()) return false;
  if (decision.keep != wire::ImageSlot::none &&
      decision.state[static_cast<std::size_t>(decision.keep)] == wire::ImageState::confirmed)
    return append(store_,
                  {BootEvent::confirmed, decision.keep, tag_of(*header_in(store_.slot(decision.keep)))});
  return counter == 0 || append(store_, {BootEvent::raised, slot_, tag_of_counter(counter)});
}

template <SlotStore S>
UpdateReply UpdateSession<S>::add(const wire::UpdateData& data) {
  using enum wire::UpdateOutcome;
  if (!image_) return {not_begun, 0};
  if (data.count == 0 || data.count % 4 != 0) return {malformed, 0};
  if (!store_.supply_sound()) return {supply_low, 0};
  if (data.offset != held_ || data.count > image_->code_bytes - held_) return {wrong_offset, held_};
  if (!store_.write_slot(slot_, wire::kImageHeaderArea + held_, std::span(data.data).first(data.count))) {
    (void)store_.write_slot(slot_, 0, std::array<std::uint8_t, 4>{});
    return refuse(flash_failed, held_);
  }
  held_ += data.count;
  return {};
}

template <SlotStore S>
UpdateReply UpdateSession<S>::finish() {
  using enum wire::UpdateOutcome;
  if (!image_) return {not_begun, 0};
  if (held_ != image_->code_bytes) return {wrong_offset, held_};
  const SlotFacts facts = inspect(store_, slot_);
  if (!facts.verified) {
    // Without its header the next update of this image begins anew.
    (void)store_.write_slot(slot_, 0, std::array<std::uint8_t, 4>{});
    held_ = 0;
    return refuse(not_verified);
  }
  const BootDecision decision = decide(store_);
  if (decision.state[static_cast<std::size_t>(slot_)] == wire::ImageState::installed) return {};
  if (!store_.supply_sound()) return {supply_low, 0};
  if (!append(store_, {BootEvent::installed, slot_, facts.tag})) return refuse(flash_failed, 0);
  return {};
}

}  // namespace diastole::boot
