// The peripherals' models against the vendor's description, register by register, and the judge that holds every access of a
// program against it.

#include <gmock/gmock.h>

#include <bit>
#include <set>
#include <string>

#include "tests/tools/sim_board/test_image.hpp"
#include "tools/sim_board/chip.hpp"

namespace diastole {
namespace {

using board_model::Chip;
using board_model::register_facts;
using board_model::RegisterFact;
using board_model::RegisterJudge;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr uint32_t rcc = 0x4002'3800;

class Facts : public testing::Test {
 protected:
  Facts() {
    chip.reset(board_model::ResetCause::power);
    for (const uint32_t enable : {0x30U, 0x34U, 0x40U, 0x44U})
      chip.bus.write(rcc + enable, chip.bus.read(rcc + enable, 4) | judge.fact_at(rcc + enable)->writable, 4);
    for (const uint32_t enable : {0x30U, 0x34U, 0x40U, 0x44U})
      (void)chip.bus.read(rcc + enable, 4);
  }

  RegisterJudge judge;
  Chip chip{8'000'000,
            1,
            0x1007'6413,
            board_model::FlashTiming::hits,
            {[](uint8_t, board_model::Cycles) {}, [](uint8_t, uint8_t, board_model::Cycles) {},
             [](board_model::ResetCause) {}, [] {}, [](uint32_t, uint32_t) {}}};
};

/// Registers whose value after reset depends on what the chip does, and why.
bool depends_on_the_chip(const RegisterFact& fact) {
  if (fact.peripheral == "RCC" && (fact.name.ends_with("ENR") && !fact.name.ends_with("LPENR")))
    return true;  // this test has switched the clocks on
  if (fact.peripheral.starts_with("GPIO") && fact.name == "IDR") return true;  // levels of pins
  if (fact.peripheral == "PWR" && fact.name == "CSR") return true;             // the regulator is ready
  if (fact.peripheral == "RNG" && fact.name == "DR") return true;
  // The description says 0, RM0090 18.4.12 all ones: the firmware writes it before use.
  if (fact.peripheral.starts_with("TIM") && fact.name == "ARR") return true;
  return false;
}

TEST_F(Facts, EveryModelledRegisterHasItsValueAfterReset) {
  int compared = 0;
  for (const auto& [address, fact] : judge.facts()) {
    if (fact.readable == 0 || depends_on_the_chip(fact)) continue;
    ++compared;
    EXPECT_EQ(chip.bus.read(address, 4), fact.reset) << fact.peripheral << '_' << fact.name;
  }
  EXPECT_GT(compared, 190);
  // Nothing else that can be read is 0 for want of a model; the firmware reads none of these.
  std::set<std::string> notes;
  for (const auto& [note, count] : chip.notes.all())
    notes.insert(note);
  EXPECT_THAT(notes, ElementsAre(HasSubstr("ADC1 at 0x40012308"),    // CDR
                                 HasSubstr("DAC at 0x40007424"),     // DHR12LD
                                 HasSubstr("DAC at 0x40007428"),     // DHR8RD
                                 HasSubstr("DAC at 0x40007434"),     // SR
                                 HasSubstr("DMA1 at 0x40026008"),    // LIFCR
                                 HasSubstr("DMA1 at 0x4002600c")));  // HIFCR
  std::printf("%d registers of %zu compared\n", compared, judge.facts().size());
}

TEST_F(Facts, EveryRegisterHasItsPlaceAmongThoseOfTheFirmware) {
  for (const RegisterFact& fact : register_facts) {
    EXPECT_EQ(fact.offset % 4, 0U);
    EXPECT_EQ(fact.size_bits, 32U) << fact.peripheral << '_' << fact.name;
    EXPECT_LT(fact.offset, 0x400U);
  }
}

/// Plain storage holds what is written to it; reserved bits are no storage for the firmware, whatever they do.
TEST_F(Facts, BitsThatCanBeReadAndWrittenAreHeld) {
  constexpr std::string_view plain[] = {"PSC",     "ARR",   "CCR1",   "CCR2",    "CCR3", "CCR4", "DIER",
                                        "CCER",    "PUPDR", "OTYPER", "OSPEEDR", "AFRL", "AFRH", "BRR",
                                        "EXTICR1", "S5PAR", "S5M0AR", "RTSR",    "FTSR"};
  int tried = 0;
  for (const auto& [address, fact] : judge.facts()) {
    if (std::ranges::find(plain, fact.name) == std::end(plain)) continue;
    // TIM3 and TIM4 have 16 bits (datasheet table 6), which the description draws as 32.
    const uint32_t bits = fact.peripheral == "TIM3" || fact.peripheral == "TIM4" ? 0xffffU : 0xffff'ffffU;
    const uint32_t pattern = fact.writable & fact.readable & bits & 0x5a5a'a5a5U;
    chip.bus.write(address, pattern | (fact.reset & ~fact.known()), 4);
    EXPECT_EQ(chip.bus.read(address, 4) & fact.known(), pattern) << fact.peripheral << '_' << fact.name;
    ++tried;
  }
  EXPECT_GT(tried, 30);
  EXPECT_THAT(chip.notes.all(), IsEmpty());
}

TEST_F(Facts, WhatTheManualForbidsIsTold) {
  const auto reported = [this](auto&& access) {
    board_model::Notes& notes = chip.notes;
    const std::size_t before = notes.all().size();
    access(chip.bus);
    return notes.all().size() > before;
  };
  EXPECT_TRUE(reported([](auto& bus) { bus.write(rcc + 0x04, 0x0401'5008, 4); }))
      << "PLLCFGR without its reserved bit";
  EXPECT_TRUE(reported([](auto& bus) { bus.write(0x4000'0010, 0xffff'fffe, 4); }))
      << "reserved flags of TIM2_SR";
  EXPECT_TRUE(reported([](auto& bus) { bus.write(0x4000'7408, 1, 2); })) << "half a word to the DAC";
  EXPECT_TRUE(reported([](auto& bus) { bus.write(0x4000'0034, 1, 1); })) << "a byte to a timer";
  EXPECT_TRUE(reported([](auto& bus) { (void)bus.read(0x4002'3c04, 4); })) << "FLASH_KEYR is written only";
  EXPECT_TRUE(reported([](auto& bus) { (void)bus.read(0x4000'7038, 4); })) << "PWR ends at CSR";
  EXPECT_TRUE(reported([](auto& bus) { (void)bus.read(0xe000'e01c, 4); })) << "SysTick's CALIB has no model";
  EXPECT_FALSE(reported([](auto& bus) { (void)bus.read(0x4000'300c, 4); })) << "IWDG_SR is 0 and has one";
  EXPECT_TRUE(reported([](auto& bus) { bus.write(rcc + 0x40, 0, 4), bus.write(0x4000'0000, 1, 4); }))
      << "no clock";
  EXPECT_TRUE(reported([](auto& bus) { bus.write(rcc + 0x40, 1, 4), bus.write(0x4000'0000, 1, 4); }))
      << "its clock has only just been enabled";
  EXPECT_FALSE(reported([](auto& bus) {
    bus.write(rcc + 0x40, 0, 4), bus.write(rcc + 0x40, 1, 4);
    (void)bus.read(rcc + 0x40, 4);
    bus.write(0x4000'0000, 1, 4);
  }));
}

}  // namespace
}  // namespace diastole
