// sim_board: the controller's real image on an emulated STM32F405. See --help.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "protocol/contract/command.hpp"
#include "protocol/contract/exit_code.hpp"
#include "protocol/contract/json_text.hpp"
#include "tools/program/program.hpp"
#include "tools/sim_board/session.hpp"

namespace {

using diastole::ExitCode;

constexpr const char* purpose =
    R"(Runs the controller's image, the very bytes that are flashed, on an STM32F405 in software: instructions, interrupts
and registers of the peripherals, with every change of a pin logged. Time is the board's own: the same run gives the
same trace, to the byte, however fast this machine is.

  sim_board build/firmware/bin/diastole-stm32f405.bin --seconds 2 --report
      two seconds of board time as fast as it goes, then sizes, stack, interrupt costs

  sim_board build/firmware/bin/diastole-stm32f405.elf --link /tmp/pump --real-time --pins trace.csv
      a board behind the serial port /tmp/pump until Ctrl-C; `diastole daemon` or `diastole flash` can talk to it

  sim_board bootloader.bin --flash board.flash --link /tmp/pump --real-time --power-cut 17
      the flash is kept in a file between runs; power fails in the middle of its 17th operation and comes back
      half a second later)";

constexpr const char* footer =
    R"(IMAGE is a plain binary (placed at 0x08000000, or FILE@ADDRESS) or an ELF file; several are allowed.
The pin trace has a row a change, time_ns,signal,value: STEP, DIR (1 inflate), ENABLE, TTL, RWAVE_uV, FAULT.
Exit codes: 0 done, 1 the firmware ended in a fault it did not recover from, 2 wrong usage or input, 3 no
pseudo-terminal or no emulator.)";

void add_options(CLI::App& app, diastole::SessionOptions& options, bool& report, bool& json) {
  app.add_option("IMAGE", options.images, "image file, FILE or FILE@ADDRESS")->required();
  app.add_option("--link", options.link,
                 "serve the serial port as a pseudo-terminal with this symbolic link");
  app.add_option("--pins", options.pins, "write the pin trace to this CSV file");
  app.add_option(
      "--flash", options.flash,
      "keep the flash in this file: read at the start if it exists (it wins over IMAGE), written at the end");
  app.add_flag("--real-time", options.real_time,
               "follow the wall clock; without it, as fast as the machine goes");
  app.add_option("--seconds", options.seconds, "end after this much board time (default: run until Ctrl-C)")
      ->check(diastole::positive_number);
  app.add_option(
      "--estop-at", options.estop_at,
      "press the e-stop at this time in seconds, or from one to another: 2.5 or 2.5..4; may be repeated");
  app.add_option("--limit-at", options.limit_at,
                 "close a limit switch: 2.5:home, 2.5:far or 2.5..4:far; may be repeated");
  app.add_flag("--loop-back", options.loop_back, "put the wires of `diastole selftest` on");
  app.add_option("--power-cut", options.power_cut,
                 "cut the power in the middle of flash operation N (1 is the first)")
      ->check(diastole::positive_number);
  app.add_option("--crystal-Hz", options.crystal_Hz,
                 "the board's crystal (Olimex H405 8 MHz, Feather F405 12 MHz)")
      ->capture_default_str();
  using diastole::board_model::FlashTiming;
  app.add_option(
         "--wait-states", options.flash_timing,
         "what the flash's wait states cost: hits (nothing, as if all were cached), cached, or misses "
         "(every line and every read waits)")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, FlashTiming>{
              {"hits", FlashTiming::hits}, {"cached", FlashTiming::cached}, {"misses", FlashTiming::misses}},
          CLI::ignore_case))
      ->default_str("hits");
  app.add_flag("--report", report, "at the end, print what the run has shown");
  app.add_flag("--json", json, "at the end, print it as one JSON document");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(purpose, "sim_board");
  app.footer(footer);
  diastole::SessionOptions options;
  bool report = false, json = false;
  add_options(app, options, report, json);
  return diastole::run_program(app, argc, argv, [&] {
    const diastole::BoardReport shown = diastole::run_session(options, diastole::stop_descriptor());
    if (json) fmt::print("{}\n", diastole::json_text(diastole::to_json(shown), 2));
    if (report) fmt::print(json ? stderr : stdout, "{}", diastole::to_text(shown));
    return shown.board.locked_up ? ExitCode::negative : ExitCode::done;
  });
}
