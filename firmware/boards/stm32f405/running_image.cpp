#include "firmware/boards/stm32f405/running_image.hpp"

#include "firmware/boards/stm32f405/flash_slots.hpp"
#include "firmware/boards/stm32f405/hand_over.hpp"

extern "C" const std::uint8_t __image_header[];

namespace diastole::stm32 {

namespace {

wire::ImageSlot own_slot() {
  const auto address = reinterpret_cast<std::uintptr_t>(__image_header);
  return address == kSlotSectors[0].address ? wire::ImageSlot::a : wire::ImageSlot::b;
}

}  // namespace

firmware::RunningImage running_image() {
  const FlashSlots slots;
  firmware::RunningImage image;
  image.slot = own_slot();
  image.link_address = slots.slot_address(image.slot);
  const auto header = boot::header_in(slots.slot(image.slot));
  if (!header) return image;
  image.version = header->version;
  image.build_id = header->build_id;
  image.code_bytes = header->code_bytes;
  boot::BootEvent last = boot::BootEvent::none;
  boot::for_each_record(slots.records(), [&](const boot::BootRecord& record) {
    if (record.slot == image.slot && record.tag == boot::tag_of(*header)) last = record.event;
  });
  const bool trial = read_hand_over().value_or(HandOver{}).trial != 0;
  image.state = last == boot::BootEvent::confirmed ? wire::ImageState::confirmed
                : trial                            ? wire::ImageState::on_trial
                : last == boot::BootEvent::tried   ? wire::ImageState::failed
                                                   : wire::ImageState::unrecorded;
  return image;
}

bool takes_unsigned_firmware() { return boot::is_erased(FlashSlots().signing_key()); }

bool confirm_running_image() {
  FlashSlots slots;
  const wire::ImageSlot slot = own_slot();
  const auto header = boot::header_in(slots.slot(slot));
  return header && boot::append(slots, {boot::BootEvent::confirmed, slot, boot::tag_of(*header)});
}

void restart(bool into_bootloader) {
  HandOver hand_over = read_hand_over().value_or(HandOver{});
  hand_over.command = into_bootloader ? HandOverCommand::stay : HandOverCommand::none;
  write_hand_over(hand_over);
  reset();
}

}  // namespace diastole::stm32
