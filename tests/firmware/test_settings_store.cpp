// Settings in a simulated flash whose power fails at every single operation.

#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <random>
#include <vector>

#include "firmware/core/settings_store.hpp"
#include "protocol/wire/crc32.hpp"

namespace diastole::firmware {
namespace {

struct PowerCut {};

/// How an operation that power failed in leaves its cells.
enum class Torn { untouched, half, random };

/// Two small sectors; words are programmed one operation each.
class FailingFlash {
 public:
  static constexpr std::size_t kBytes = 4 * SettingsRecord::kSlotBytes;

  [[nodiscard]] std::span<const std::uint8_t> sector(std::size_t index) const { return cells_[index]; }
  bool erase(std::size_t index) {
    auto& cells = cells_[index];
    const bool cut = due();
    for (std::size_t i = 0; i < kBytes; ++i) {
      if (cut && !reached(i, kBytes)) continue;
      cells[i] = 0xFF;
    }
    if (cut) throw PowerCut{};
    ++erases;
    return true;
  }
  bool program(std::size_t index, std::size_t offset, std::span<const std::uint8_t> bytes) {
    EXPECT_EQ(offset % 4, 0U);
    EXPECT_LE(offset + bytes.size(), kBytes);
    for (std::size_t word = 0; word < bytes.size(); word += 4) {
      const bool cut = due();
      for (std::size_t i = word; i < word + 4; ++i) {
        std::uint8_t& cell = cells_[index][offset + i];
        const auto whole = static_cast<std::uint8_t>(cell & bytes[i]);
        if (!cut || reached(i - word, 4))
          cell = whole;
        else if (torn == Torn::random)
          cell = static_cast<std::uint8_t>(whole | (cell & random_()));
      }
      if (cut) throw PowerCut{};
    }
    return true;
  }

  std::optional<std::size_t> cut_in;  ///< operations from now
  Torn torn = Torn::half;
  std::size_t erases = 0;

 private:
  bool due() { return cut_in && (*cut_in)-- == 0; }
  bool reached(std::size_t i, std::size_t of) {
    if (torn == Torn::random) return (random_() & 1U) != 0;
    return torn == Torn::half && i < of / 2;
  }
  std::array<std::vector<std::uint8_t>, 2> cells_{std::vector<std::uint8_t>(kBytes, 0xFF),
                                                  std::vector<std::uint8_t>(kBytes, 0xFF)};
  std::mt19937 random_{1};
};

using Store = SettingsStore<FailingFlash>;

wire::MachineSettings numbered(int number) {
  wire::MachineSettings settings;
  settings.backlash_nm = number;
  settings.board_name_size = static_cast<std::uint8_t>(number % 21);
  for (std::size_t i = 0; i < settings.board_name_size; ++i)
    settings.board_name[i] = static_cast<std::uint8_t>('a' + i);
  return settings;
}

TEST(SettingsStore, ABlankFlashHasTheInitialSettings) {
  FailingFlash flash;
  const Store store(flash);
  EXPECT_EQ(store.records_written(), 0U);
  EXPECT_EQ(store.settings(), wire::MachineSettings{});
}

TEST(SettingsStore, TheLastRecordIsFoundAgainThroughManySectorSwaps) {
  FailingFlash flash;
  for (int i = 1; i <= 100; ++i) {
    Store store(flash);
    ASSERT_TRUE(store.write(numbered(i)));
    const Store after(flash);
    ASSERT_EQ(after.settings(), numbered(i));
    ASSERT_EQ(after.records_written(), static_cast<std::uint32_t>(i));
  }
  EXPECT_EQ(flash.erases, 25U) << "one erase for every four records";
}

TEST(SettingsStore, NoPowerCutLosesMoreThanTheRecordBeingWritten) {
  for (const Torn torn : {Torn::untouched, Torn::half, Torn::random}) {
    for (int before = 0; before <= 9; ++before) {
      bool reached_end = false;
      for (std::size_t operation = 0; !reached_end; ++operation) {
        FailingFlash flash;
        flash.torn = torn;
        for (int i = 1; i <= before; ++i)
          ASSERT_TRUE(Store(flash).write(numbered(i)));
        flash.cut_in = operation;
        try {
          ASSERT_TRUE(Store(flash).write(numbered(before + 1)));
          reached_end = true;
        } catch (const PowerCut&) {
        }
        flash.cut_in.reset();
        Store store(flash);
        const bool old = store.settings() == (before == 0 ? wire::MachineSettings{} : numbered(before));
        ASSERT_TRUE(old || store.settings() == numbered(before + 1)) << before << " " << operation;
        // And it goes on from there, through the next swap, with another cut in the very next write.
        flash.cut_in = operation / 2;
        try {
          ASSERT_TRUE(store.write(numbered(70)));
        } catch (const PowerCut&) {
        }
        flash.cut_in.reset();
        for (int i = 80; i < 86; ++i) {
          Store next(flash);
          ASSERT_TRUE(next.records_written() > 0 || before == 0);
          ASSERT_TRUE(next.write(numbered(i)));
          ASSERT_EQ(Store(flash).settings(), numbered(i)) << before << " " << operation;
        }
      }
    }
  }
}

TEST(SettingsStore, ACellThatDoesNotTakeItsValueCostsASlotOnly) {
  FailingFlash flash;
  ASSERT_TRUE(Store(flash).write(numbered(1)));
  // A cut that left the next slot looking erased although one cell is not.
  const std::array<std::uint8_t, 4> word{0xFF, 0xFF, 0xFE, 0xFF};
  flash.program(0, 2 * SettingsRecord::kSlotBytes, word);
  ASSERT_TRUE(Store(flash).write(numbered(2)));
  EXPECT_EQ(Store(flash).settings(), numbered(2));
  EXPECT_EQ(flash.erases, 1U);
}

TEST(SettingsStore, NoAlteredRecordIsBelieved) {
  const SettingsRecord::Slot slot = encode_record({7, numbered(5)});
  ASSERT_TRUE(decode_record(slot));
  for (std::size_t bit = 0; bit < slot.size() * 8; ++bit) {
    SettingsRecord::Slot altered = slot;
    altered[bit / 8] = static_cast<std::uint8_t>(altered[bit / 8] ^ (1U << (bit % 8)));
    EXPECT_FALSE(decode_record(altered)) << bit;
  }
  wire::MachineSettings wild;
  wild.microsteps = 0;
  EXPECT_FALSE(decode_record(encode_record({7, wild})));
}

/// As firmware 0.1.0 wrote it: eight settings and the name.
TEST(SettingsStore, ARecordOfTheFirstLayoutIsReadAndTheLaterSettingsAreInitial) {
  wire::MachineSettings settings;
  settings.microsteps = 16;
  settings.backlash_nm = 40'000;
  settings.board_name_size = 2;
  settings.board_name = {'M', 'R'};
  const SettingsRecord::Slot now = encode_record({7, settings});
  constexpr std::size_t body = 10, known = 8 * 4, later = 3 * 4;
  SettingsRecord::Slot first;
  first.fill(0xFF);
  const std::array<std::uint8_t, body> head{'D', 'S', 'E', 'T', 7, 0, 0, 0, known + 3, 0};
  std::ranges::copy(head, first.begin());
  std::copy_n(now.begin() + body, known, first.begin() + body);
  std::copy_n(now.begin() + body + known + later, 3, first.begin() + body + known);
  const std::uint32_t crc = wire::crc32(std::span(first).first(first.size() - 4));
  for (std::size_t i = 0; i < 4; ++i)
    first[first.size() - 4 + i] = static_cast<std::uint8_t>(crc >> (8 * i));
  const auto read = decode_record(first);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->number, 7U);
  EXPECT_EQ(read->settings, settings);
}

TEST(MachineSettings, TheNominalMicrostepIsThePapers) {
  EXPECT_EQ(wire::microstep_pL({}), 7'791'649U);
  wire::MachineSettings settings;
  settings.calibration_ppm = -1000;
  EXPECT_NEAR(wire::microstep_pL(settings), 7'791'649 * 0.999, 1);
  settings = {};
  settings.microsteps = 16;
  EXPECT_NEAR(wire::microstep_pL(settings), 7'791'649 / 2.0, 1);
  EXPECT_NEAR(static_cast<double>(wire::travel_uL({})), 0.9 * 7.85398e6, 10);
}

TEST(MachineSettings, BacklashIsCountedInMicrosteps) {
  wire::MachineSettings settings;
  settings.backlash_nm = 50'000;
  EXPECT_EQ(wire::backlash_microsteps(settings), 50U);  // 1008 microsteps a mm
  settings.microsteps = 1;
  EXPECT_EQ(wire::backlash_microsteps(settings), 6U);
}

TEST(MachineSettings, EverySettingIsBoundedOnBothSides) {
#define DIASTOLE_SETTING(number, name, least, initial, most, shown, scale, explanation) \
  for (const bool above : {false, true}) {                                              \
    wire::MachineSettings settings;                                                     \
    settings.name = above ? (most) : (least);                                           \
    EXPECT_FALSE(wire::out_of_range(settings).found) << #name;                          \
    settings.name = above ? (most) + 1 : (least)-1;                                     \
    const wire::SettingOutOfRange outside = wire::out_of_range(settings);               \
    EXPECT_TRUE(outside.found) << #name;                                                \
    EXPECT_EQ(outside.setting, wire::Setting::name);                                    \
    EXPECT_EQ(outside.allowed, above ? (most) : (least)) << #name;                      \
  }
#include "protocol/wire/setting_list.inc"
}

}  // namespace
}  // namespace diastole::firmware
