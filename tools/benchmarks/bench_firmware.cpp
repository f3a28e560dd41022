// What a step costs the controller and how fast it can go, measured on the image that is flashed, in the emulated
// board: one instruction is one cycle of 168 MHz (tools/sim_board/README.md).
//
//   tools/bench firmware            or   build/release/bin/bench_firmware [IMAGE]

#include <fmt/format.h>

#include <cstdio>
#include <string>

#include "protocol/contract/exit_code.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/wire/wire_text.hpp"
#include "tools/benchmarks/step_rate.hpp"

namespace {

using diastole::StepRateFigures;
using diastole::StepRateTrial;
using diastole::wire::Waveform;

constexpr uint32_t inputs_irq = 6, end_stop_irq = 7, r_wave_irq = 16, clock_irq = 28, serial_irq = 39,
                   step_irq = 50;

void print_cost(const char* what, const StepRateTrial& trial, const StepRateFigures& figures) {
  fmt::print("{:<30}{:>9.0f}{:>14.0f}{:>10.0f} %  {}\n", what, trial.peak_rate_Hz, figures.instructions,
             100 * figures.headroom, figures.problem.empty() ? "all steps in time" : figures.problem);
  std::fflush(stdout);
}

/// Every waveform around its steepest part.
void print_waveforms(const std::string& image) {
  struct Part {
    Waveform waveform;
    double from, to;
  };
  constexpr Part parts[] = {{Waveform::parabolic, 0.2, 0.3},          {Waveform::sinusoidal, 0.2, 0.3},
                            {Waveform::trapezoidal, 0.05, 0.2},       {Waveform::sawtooth, 0.8, 0.95},
                            {Waveform::reversed_sawtooth, 0.05, 0.2}, {Waveform::uploaded, 0.2, 0.3}};
  fmt::print("{:<30}{:>9}{:>14}{:>12}\n", "waveform at its peak", "steps/s", "instructions", "asleep");
  for (const Part& part : parts) {
    const StepRateTrial trial{.waveform = part.waveform, .period_s = 1.0, .from = part.from, .to = part.to};
    print_cost(std::string(diastole::wire::waveform_name(part.waveform)).c_str(), trial,
               measure(image, trial));
  }
}

void print_rates(const std::string& image) {
  fmt::print("\n{:<30}{:>9}{:>14}{:>12}\n", "trapezoid's even part", "steps/s", "instructions", "asleep");
  for (const double rate_Hz : {30e3, 100e3, 200e3, 300e3, 350e3, 400e3}) {
    for (const bool flood : {false, true}) {
      const StepRateTrial trial{.peak_rate_Hz = rate_Hz, .period_s = 1.0, .flood = flood};
      print_cost(flood ? "  the serial line flooded" : "", trial, measure(image, trial));
    }
  }
}

/// The even part of a trapezoid and the dearest profile, by how well the flash's caches do.
void print_wait_states(const std::string& image) {
  using diastole::board_model::FlashTiming;
  struct Case {
    const char* name;
    FlashTiming timing;
  };
  constexpr Case cases[] = {{"all in the caches", FlashTiming::hits},
                            {"caches as in the manual", FlashTiming::cached},
                            {"no cache, no prefetch", FlashTiming::misses}};
  fmt::print("\n{:<52}{:>9}{:>15}{:>10}\n", "5 wait states", "steps/s", "cycles a step", "asleep");
  for (const Waveform waveform : {Waveform::trapezoidal, Waveform::sinusoidal, Waveform::uploaded}) {
    for (const double rate_Hz : {100e3, 200e3}) {
      for (const bool flood : {false, true}) {
        for (const Case& each : cases) {
          StepRateTrial trial{.waveform = waveform,
                              .peak_rate_Hz = rate_Hz,
                              .period_s = 1.0,
                              .flood = flood,
                              .timing = each.timing};
          if (waveform != Waveform::trapezoidal) trial.from = 0.2, trial.to = 0.3;
          const StepRateFigures figures = measure(image, trial);
          const bool held = figures.problem.empty();
          fmt::print("{:<52}{:>9.0f}{:>15}{:>10}  {}\n",
                     fmt::format("{}, line {}, {}", diastole::wire::waveform_name(waveform),
                                 flood ? "flooded" : "quiet", each.name),
                     rate_Hz, held ? fmt::format("{:.0f}", figures.cycles) : "-",
                     held ? fmt::format("{:.0f} %", 100 * figures.headroom) : "-",
                     held ? "all steps in time" : figures.problem);
          std::fflush(stdout);
        }
      }
    }
  }
}

void print_interrupts(const std::string& image) {
  const StepRateFigures figures = diastole::measure_interrupts(image);
  fmt::print("\n{:<30}{:>14}{:>22}\n", "interrupt at worst", "instructions", "latency, cycles");
  const auto line = [&](const char* name, uint32_t irq) {
    fmt::print("{:<30}{:>14}{:>22}\n", name, figures.worst_instructions(irq),
               figures.worst_latency_cycles(irq));
  };
  line("step (TIM5)", step_irq);
  line("clock and TTL (TIM2)", clock_irq);
  line("e-stop (EXTI0)", inputs_irq);
  line("home switch (EXTI1)", end_stop_irq);
  line("serial (USART3)", serial_irq);
  line("R-wave's end (DMA1 stream 5)", r_wave_irq);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string image = argc > 1 ? argv[1] : "build/firmware/bin/diastole-stm32f405.elf";
  try {
    print_waveforms(image);
    print_rates(image);
    print_wait_states(image);
    print_interrupts(image);
    return 0;
  } catch (const diastole::InputError& error) {
    fmt::print(stderr, "bench_firmware: {}\n", error.what());
    return static_cast<int>(diastole::ExitCode::bad_input);
  }
}
