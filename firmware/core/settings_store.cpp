#include "firmware/core/settings_store.hpp"

#include "protocol/wire/crc32.hpp"
#include "protocol/wire/field_codec.hpp"

namespace diastole::firmware {

namespace {

constexpr std::size_t kHeadBytes = 10;
constexpr std::size_t kCrcAt = SettingsRecord::kSlotBytes - 4;

struct Head {
  std::uint32_t magic = SettingsRecord::kMagic;
  std::uint32_t number = 0;
  std::uint16_t body_bytes = 0;

  template <class Self, class Visitor>
  static constexpr void layout(Self& self, Visitor& visit) {
    visit.field("magic", self.magic);
    visit.field("number", self.number, 1U);
    visit.field("body_bytes", self.body_bytes, std::uint16_t{1}, std::uint16_t{kCrcAt - kHeadBytes});
  }
};

struct Crc {
  std::uint32_t value = 0;

  template <class Self, class Visitor>
  static constexpr void layout(Self& self, Visitor& visit) {
    visit.field("crc", self.value);
  }
};

template <class Part>
std::size_t put(const Part& part, std::span<std::uint8_t> out) {
  wire::FieldWriter writer(out);
  Part::layout(part, writer);
  return writer.size();
}

template <class Part>
bool get(Part& part, std::span<const std::uint8_t> in) {
  wire::FieldReader reader(in);
  Part::layout(part, reader);
  return reader.fault().problem == wire::DecodeProblem::none;
}

}  // namespace

SettingsRecord::Slot encode_record(const SettingsRecord& record) {
  SettingsRecord::Slot slot;
  slot.fill(0xFF);
  const std::span bytes(slot);
  Head head;
  head.number = record.number;
  head.body_bytes =
      static_cast<std::uint16_t>(put(record.settings, bytes.subspan(kHeadBytes, kCrcAt - kHeadBytes)));
  put(head, bytes.first(kHeadBytes));
  put(Crc{wire::crc32(bytes.first(kCrcAt))}, bytes.last(4));
  return slot;
}

std::optional<SettingsRecord> decode_record(std::span<const std::uint8_t> slot) {
  Head head;
  Crc crc;
  SettingsRecord record;
  if (!get(head, slot.first(kHeadBytes)) || !get(crc, slot.last(4))) return {};
  const bool first_layout = head.magic == SettingsRecord::kFirstMagic;
  if (!first_layout && head.magic != SettingsRecord::kMagic) return {};
  if (crc.value != wire::crc32(slot.first(kCrcAt))) return {};
  wire::FieldReader body(slot.subspan(kHeadBytes, head.body_bytes));
  wire::MachineSettings::layout(record.settings, body,
                                first_layout ? SettingsRecord::kFirstSettings : SettingsRecord::kSettings);
  if (body.fault().problem != wire::DecodeProblem::none) return {};
  if (wire::out_of_range(record.settings).found) return {};
  record.number = head.number;
  return record;
}

}  // namespace diastole::firmware
