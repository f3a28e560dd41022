#include "firmware/boot/boot_decision.hpp"

#include <cstddef>

namespace diastole::boot {

namespace {

using wire::ImageSlot;
using wire::ImageState;

struct LastEvent {
  BootEvent event = BootEvent::none;
  int age = 0;  ///< number of the record: the greater, the younger
};

ImageState state_of(const SlotFacts& slot, BootEvent last, bool half_erased) {
  if (!slot.has_header || half_erased) return ImageState::empty;
  if (slot.refused) return ImageState::refused;
  if (!slot.verified) return ImageState::incomplete;
  switch (last) {
    case BootEvent::installed:
      return ImageState::installed;
    case BootEvent::tried:
      return ImageState::failed;
    case BootEvent::confirmed:
      return ImageState::confirmed;
    case BootEvent::none:
    case BootEvent::erase_begun:
    case BootEvent::erased:
    case BootEvent::raised:
      break;
  }
  return ImageState::unrecorded;
}

ImageSlot slot_of(std::size_t index) { return static_cast<ImageSlot>(index); }

}  // namespace

BootDecision decide(std::span<const std::uint8_t> records, const std::array<SlotFacts, 2>& slots) {
  std::array<LastEvent, 2> last{};
  int age = 0;
  for_each_record(records, [&](const BootRecord& record) {
    const auto index = static_cast<std::size_t>(record.slot);
    if (!of_slot(record.event) && record.event != BootEvent::raised && slots[index].has_header &&
        slots[index].tag == record.tag)
      last[index] = {record.event, ++age};
  });

  // Only the slot that is not the last one to start is ever erased; a record that says otherwise outlived, in a sector of
  // records whose own erase was cut off, those that came after it.
  const auto half_erased = [&](std::size_t i) {
    const std::size_t other = 1 - i;
    return erase_interrupted(records, slot_of(i)) && slots[other].verified &&
           !erase_interrupted(records, slot_of(other));
  };
  BootDecision decision;
  for (std::size_t i = 0; i < slots.size(); ++i)
    decision.state[i] = state_of(slots[i], last[i].event, half_erased(i));
  const auto newest = [&](ImageState wanted) {
    ImageSlot found = ImageSlot::none;
    int found_age = -1;
    for (std::size_t i = 0; i < slots.size(); ++i) {
      if (decision.state[i] != wanted || last[i].age <= found_age) continue;
      found = slot_of(i);
      found_age = last[i].age;
    }
    return found;
  };

  for (const ImageState state : {ImageState::confirmed, ImageState::unrecorded, ImageState::failed})
    if (decision.keep == ImageSlot::none) decision.keep = newest(state);
  const ImageSlot installed = newest(ImageState::installed);
  const ImageSlot kept = decision.keep != ImageSlot::none ? decision.keep : installed;
  decision.trial = installed != ImageSlot::none && records_left(records) > 0;
  decision.start = decision.trial ? installed : kept;
  decision.free = kept == ImageSlot::a ? ImageSlot::b : ImageSlot::a;
  return decision;
}

}  // namespace diastole::boot
