#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "protocol/contract/named_members.hpp"
#include "tools/sim_board/session.hpp"

namespace diastole {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(BoardStatistics, core_Hz, cycles, instructions, stack_top,
                                   stack_used_bytes, flash_operations, serial_overruns, missed_deadlines,
                                   locked_up)

namespace {

constexpr uint32_t core_exception_base = 0x8000'0000;
constexpr uint32_t flash_size = 1024 * 1024, ram_size = 128 * 1024;  // of the STM32F405RG; 64 KB CCM apart

std::string interrupt_name(uint32_t irq) {
  if (irq < core_exception_base) return fmt::format("IRQ {}", irq);
  static const std::map<uint32_t, std::string> names{{3, "HardFault"}, {5, "BusFault"}, {6, "UsageFault"},
                                                     {11, "SVCall"},   {14, "PendSV"},  {15, "SysTick"}};
  const auto found = names.find(irq - core_exception_base);
  return found != names.end() ? found->second : fmt::format("exception {}", irq - core_exception_base);
}

uint64_t flash_bytes(const BoardReport& report) {
  uint64_t sum = 0;
  for (const Image& image : report.images)
    sum += image.flash_bytes;
  return sum;
}

double board_s(const BoardReport& report) { return static_cast<double>(report.board.time_ns) * 1e-9; }
double times_real_time(const BoardReport& report) {
  return report.wall_s > 0 ? board_s(report) / report.wall_s : 0;
}

}  // namespace

nlohmann::json to_json(const BoardReport& report) {
  const BoardStatistics& board = report.board;
  nlohmann::json document = board;
  document.update({{"simulated_seconds", board_s(report)},
                   {"wall_seconds", report.wall_s},
                   {"times_real_time", times_real_time(report)},
                   {"steps", report.steps},
                   {"triggers", report.triggers},
                   {"flash_bytes", flash_bytes(report)},
                   {"fault", board.last_fault}});
  for (const Image& image : report.images) {
    nlohmann::json one = {{"file", image.file}, {"flash_bytes", image.flash_bytes}};
    if (image.static_ram_bytes) one["static_ram_bytes"] = *image.static_ram_bytes;
    document["images"].push_back(one);
  }
  document["interrupts"] = nlohmann::json::array();
  for (const InterruptStatistics& interrupt : board.interrupts) {
    document["interrupts"].push_back(
        {{"name", interrupt_name(interrupt.irq)},
         DIASTOLE_NAMED(interrupt, count, worst_instructions, worst_latency_cycles)});
  }
  document["resets"] = nlohmann::json::array();
  for (const BoardReset& reset : board.resets) {
    document["resets"].push_back({DIASTOLE_NAMED(reset, time_ns, cause)});
  }
  document["notes"] = nlohmann::json::array();
  for (const auto& [text, note] : board.notes) {
    document["notes"].push_back({{"text", text}, DIASTOLE_NAMED(note, first_ns, count)});
  }
  return document;
}

std::string to_text(const BoardReport& report) {
  const BoardStatistics& board = report.board;
  std::string text =
      fmt::format("{:.3f} s on the board in {:.3f} s ({:.1f} times real time), core at {:.0f} MHz\n",
                  board_s(report), report.wall_s, times_real_time(report), board.core_Hz * 1e-6) +
      fmt::format("{} instructions, {} steps, {} triggers, {} flash operations\n", board.instructions,
                  report.steps, report.triggers, board.flash_operations);
  for (const Image& image : report.images) {
    text += fmt::format("{}: {} of {} bytes of flash", image.file, image.flash_bytes, flash_size);
    if (image.static_ram_bytes)
      text += fmt::format(", {} of {} bytes of RAM, static", *image.static_ram_bytes, ram_size);
    text += '\n';
  }
  text += fmt::format("deepest stack {} bytes below 0x{:08x}; serial overruns {}; missed deadlines {}\n",
                      board.stack_used_bytes, board.stack_top, board.serial_overruns, board.missed_deadlines);
  for (const InterruptStatistics& interrupt : board.interrupts) {
    text += fmt::format("{:<12} {:>9} times, at worst {:>5} instructions, {:>5} cycles after it was due\n",
                        interrupt_name(interrupt.irq), interrupt.count, interrupt.worst_instructions,
                        interrupt.worst_latency_cycles);
  }
  for (const BoardReset& reset : board.resets) {
    text += fmt::format("reset by {} at {:.6f} s\n", reset.cause, static_cast<double>(reset.time_ns) * 1e-9);
  }
  for (const auto& [note, seen] : board.notes) {
    text += fmt::format("note: {} ({} times, first at {:.6f} s)\n", note, seen.count,
                        static_cast<double>(seen.first_ns) * 1e-9);
  }
  if (board.locked_up) text += "the core has locked up: only a reset helps\n";
  return text;
}

}  // namespace diastole
