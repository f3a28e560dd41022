#pragma once
// Slots and records in this machine's memory, with the flash's manners: ones become zeros, an erase makes all
// ones, and the power can fail in the middle of any operation, which then is half done. A sector whose erase was cut off
// keeps weak cells until it is erased to the end: some of its ones later read as zeros (let_weak_cells_fall).

#include <random>
#include <vector>

#include "firmware/boot/slot_store.hpp"

namespace diastole::boot_test {

using wire::ImageSlot;

struct PowerCut {};

class MemorySlots {
 public:
  static constexpr std::uint16_t kBoard = 2;

  explicit MemorySlots(std::size_t slot_bytes = 0x2'0000, std::size_t record_bytes = 0x4000)
      : slots_{Bytes(slot_bytes, 0xFF), Bytes(slot_bytes, 0xFF)}, records_(record_bytes, 0xFF) {}

  [[nodiscard]] std::uint16_t board_id() const { return kBoard; }
  [[nodiscard]] std::uint32_t slot_address(ImageSlot slot) const {
    return slot == ImageSlot::b ? 0x0804'0000 : 0x0802'0000;
  }
  [[nodiscard]] std::span<const std::uint8_t> slot(ImageSlot slot) const { return slots_[index(slot)]; }
  [[nodiscard]] std::span<const std::uint8_t> records() const { return records_; }
  [[nodiscard]] std::span<const std::uint8_t, 32> signing_key() const { return key_; }
  /// From now on only images signed with its secret are taken.
  void lock(const signing::PublicKey& key) { key_ = key; }
  [[nodiscard]] bool supply_sound() const { return supply_sound_; }
  bool erase_slot(ImageSlot slot) { return erase(slots_[index(slot)], weak_[index(slot)]); }
  bool erase_records() { return erase(records_, weak_[2]); }
  bool write_slot(ImageSlot slot, std::size_t offset, std::span<const std::uint8_t> bytes) {
    return write(slots_[index(slot)], offset, bytes);
  }
  bool write_record(std::size_t offset, std::span<const std::uint8_t> bytes) {
    return write(records_, offset, bytes);
  }

  /// Power fails in the middle of operation `operation` (1 is the next one): PowerCut is thrown. Which half
  /// of it is done is drawn from the seed.
  void cut_power_at(std::uint64_t operation, std::uint32_t seed) {
    cut_at_ = operations_ + operation;
    random_.seed(seed);
  }
  /// Every erase that is cut off leaves its sector reading blank.
  void cut_erases_late() { late_ = true; }
  /// Weak cells that hold a one read as zeros from now on, one in a thousand.
  void let_weak_cells_fall() {
    const auto fall = [this](Bytes& sector, bool weak) {
      if (!weak) return;
      for (std::uint8_t& byte : sector)
        if (random_() % 125 == 0) byte = static_cast<std::uint8_t>(byte & ~(1U << random_() % 8));
    };
    for (std::size_t i = 0; i < 2; ++i)
      fall(slots_[i], weak_[i]);
    fall(records_, weak_[2]);
  }
  void set_supply_sound(bool sound) { supply_sound_ = sound; }
  void never_cut_power() { cut_at_ = 0; }
  [[nodiscard]] std::uint64_t operations() const { return operations_; }
  std::vector<std::uint8_t>& bytes(ImageSlot slot) { return slots_[index(slot)]; }
  std::vector<std::uint8_t>& record_bytes() { return records_; }

 private:
  using Bytes = std::vector<std::uint8_t>;
  static std::size_t index(ImageSlot slot) { return static_cast<std::size_t>(slot); }
  bool cut_now() { return ++operations_ == cut_at_; }

  bool erase(Bytes& sector, bool& weak) {
    weak = cut_now();
    if (weak) {
      // Some stretch of it is erased, the rest as it was.
      const std::size_t from = late_ ? 0 : random_() % sector.size(),
                        to = late_ ? sector.size() : from + random_() % (sector.size() - from);
      std::fill(sector.begin() + static_cast<std::ptrdiff_t>(from),
                sector.begin() + static_cast<std::ptrdiff_t>(to), std::uint8_t{0xFF});
      throw PowerCut{};
    }
    std::fill(sector.begin(), sector.end(), std::uint8_t{0xFF});
    return true;
  }

  bool write(Bytes& sector, std::size_t offset, std::span<const std::uint8_t> bytes) {
    for (std::size_t at = 0; at < bytes.size(); at += 4) {
      const auto place = std::span(sector).subspan(offset + at, 4);
      const auto wanted = bytes.subspan(at, 4);
      if (std::equal(place.begin(), place.end(), wanted.begin())) continue;
      const bool cut = cut_now();
      for (std::size_t i = 0; i < 4; ++i) {
        if ((place[i] & wanted[i]) != wanted[i]) return false;
        // Half done: an arbitrary choice of the bits that should fall has fallen.
        const auto left = static_cast<std::uint8_t>(cut ? random_() : 0);
        place[i] = static_cast<std::uint8_t>(place[i] & (wanted[i] | left));
      }
      if (cut) throw PowerCut{};
    }
    return true;
  }

  static constexpr signing::PublicKey no_key() {
    signing::PublicKey key{};
    key.fill(0xFF);
    return key;
  }

  signing::PublicKey key_ = no_key();
  std::array<Bytes, 2> slots_;
  Bytes records_;
  std::array<bool, 3> weak_{};  ///< slots, records
  bool late_ = false, supply_sound_ = true;
  std::uint64_t operations_ = 0, cut_at_ = 0;
  std::mt19937 random_;
};

/// An image's code and headers for both slots.
struct TestImage {
  std::vector<std::uint8_t> code;
  std::array<wire::ImageHeader, 2> header;
  std::array<std::optional<wire::ImageSignature>, 2> signature = {};
};

inline TestImage make_image(std::size_t code_bytes, wire::FirmwareVersion version, std::uint32_t seed) {
  std::mt19937 random(seed);
  TestImage image{std::vector<std::uint8_t>(code_bytes), {}, {}};
  for (auto& byte : image.code)
    byte = random() % 4 == 0 ? std::uint8_t{0xFF} : static_cast<std::uint8_t>(random());
  for (const ImageSlot slot : {ImageSlot::a, ImageSlot::b}) {
    wire::ImageHeader& header = image.header[static_cast<std::size_t>(slot)];
    header.board_id = MemorySlots::kBoard;
    header.link_address = MemorySlots().slot_address(slot);
    header.code_bytes = static_cast<std::uint32_t>(code_bytes);
    header.version = version;
    header.build_id = seed;
    header.sha256 = wire::digest_of(header, image.code);
  }
  return image;
}

/// The same image, vouched for.
inline TestImage signed_by(TestImage image, const signing::SecretKey& key, std::uint32_t counter) {
  for (std::size_t i = 0; i < 2; ++i) {
    const wire::SignedBytes message = wire::signed_bytes(wire::encode(image.header[i]), counter);
    image.signature[i] = wire::ImageSignature{counter, signing::sign(key, message)};
  }
  return image;
}

/// Puts an image into a slot as a programmer's cable would, without any record.
inline void put(MemorySlots& slots, ImageSlot slot, const TestImage& image) {
  const auto header = wire::encode(image.header[static_cast<std::size_t>(slot)]);
  auto& bytes = slots.bytes(slot);
  std::fill(bytes.begin(), bytes.end(), std::uint8_t{0xFF});
  std::copy(header.begin(), header.end(), bytes.begin());
  if (const auto& signature = image.signature[static_cast<std::size_t>(slot)]) {
    const auto block = wire::encode(*signature);
    std::copy(block.begin(), block.end(), bytes.begin() + wire::kImageSignatureAt);
  }
  std::copy(image.code.begin(), image.code.end(), bytes.begin() + wire::kImageHeaderArea);
}

inline boot::ImageTag tag(const TestImage& image, ImageSlot slot) {
  return boot::tag_of(image.header[static_cast<std::size_t>(slot)]);
}

}  // namespace diastole::boot_test
