#include "tools/diastole/commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include "estimator/catheter/step_fit.hpp"
#include "estimator/io/member_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/page.hpp"
#include "estimator/report/svg_plot.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/runfile/reader.hpp"
#include "protocol/runfile/run.hpp"

namespace diastole {
namespace signal {

DIASTOLE_MEMBERS(Estimate, value, se, ci95)
DIASTOLE_MEMBERS(FittedStep, time_s, before_kPa, jump_kPa, f0_Hz, zeta, rms_kPa, noise_kPa)

}  // namespace signal

namespace {

using signal::CatheterResponse;
using signal::Estimate;

// The catheter's test as a page: each step with its fit, what the fit leaves, amplitude and lag over frequency.

using report::Figure;
using report::number;
using report::SvgPlot;
using report::with_error;
using signal::Estimate;
using signal::SecondOrder;

constexpr double shown_before_s = 0.03, shown_after_s = 0.2;

struct StepTrace {
  std::vector<double> since_ms, measured_kPa, fine_ms, fitted_kPa, left_Pa;
};

StepTrace trace_of(const runfile::RecordedRun& run, const std::string& channel,
                   const signal::FittedStep& step) {
  const SecondOrder system{step.f0_Hz.value, step.zeta.value};
  const auto fitted_kPa = [&](double since_s) {
    return step.before_kPa + step.jump_kPa * signal::unit_step(system, since_s);
  };
  StepTrace trace;
  for (size_t i = step.first; i < step.last; ++i) {
    const double since_s = run.pressure.time_s[i] - step.time_s;
    if (since_s < -shown_before_s || since_s > shown_after_s) continue;
    trace.since_ms.push_back(1e3 * since_s);
    trace.measured_kPa.push_back(run.pressure.channels.at(channel)[i]);
    trace.left_Pa.push_back(1e3 * (trace.measured_kPa.back() - fitted_kPa(since_s)));
  }
  for (double since_s = -shown_before_s; since_s <= shown_after_s; since_s += 0.0005) {
    trace.fine_ms.push_back(1e3 * since_s);
    trace.fitted_kPa.push_back(fitted_kPa(since_s));
  }
  return trace;
}

void add_step(report::Page& page, const runfile::RecordedRun& run, const std::string& channel,
              const signal::FittedStep& step) {
  const StepTrace trace = trace_of(run, channel, step);
  SvgPlot fit({.x = {.label = "time since the step (ms)"}, .y = {.label = "pressure (kPa)"}});
  fit.line(trace.fine_ms, trace.fitted_kPa, "b", "second-order response");
  fit.points(trace.since_ms, trace.measured_kPa, "a", "samples");
  SvgPlot left({.x = {.label = "time since the step (ms)"}, .y = {.label = "sample − fit (Pa)"}});
  left.points(trace.since_ms, trace.left_Pa, "a");
  page.figures({{fit.svg(),
                 fmt::format("The step at {:.3f} s: {} kPa, natural frequency {} Hz, damping ratio {}.",
                             step.time_s, number(step.jump_kPa), with_error(step.f0_Hz.value, step.f0_Hz.se),
                             with_error(step.zeta.value, step.zeta.se))},
                {left.svg(),
                 fmt::format("What the fit leaves: {} Pa root mean square; the level before the step has {} "
                             "Pa of noise. A ringing here would speak for a second resonance.",
                             number(1e3 * step.rms_kPa, 2), number(1e3 * step.noise_kPa, 2))}});
}

void add_response(report::Page& page, const signal::CatheterResponse& response) {
  const SecondOrder system{response.f0_Hz.value, response.zeta.value};
  const double most_Hz = 1.5 * std::max(response.minus_3dB_Hz.value, response.lag_limit_Hz.value);
  std::vector<double> frequency_Hz, amplitude, lag_percent;
  for (int i = 0; i <= 300; ++i) {
    frequency_Hz.push_back(most_Hz * i / 300);
    amplitude.push_back(signal::amplitude_at(system, frequency_Hz.back()));
    lag_percent.push_back(100 * signal::lag_periods_at(system, frequency_Hz.back()));
  }
  SvgPlot size({.x = {.label = "frequency (Hz)"}, .y = {.label = "amplitude", .from = 0}});
  size.line(frequency_Hz, amplitude, "a");
  size.marks(std::vector<double>{response.minus_3dB_Hz.value}, "b", "-3 dB");
  SvgPlot lag({.x = {.label = "frequency (Hz)"}, .y = {.label = "lag (% of the period)", .from = 0}});
  lag.line(frequency_Hz, lag_percent, "a");
  lag.marks(std::vector<double>{response.lag_limit_Hz.value}, "b", "5 %");
  page.figures({{size.svg(), "Amplitude of a sine in the recording against the true one."},
                {lag.svg(), "How far the recording lies behind, in parts of the sine's period."}});
}

std::vector<std::string> row_of(const std::string& name, const Estimate& estimate, double scale = 1) {
  return {name, with_error(scale * estimate.value, scale * estimate.se),
          fmt::format("{} to {}", number(scale * estimate.ci95[0]), number(scale * estimate.ci95[1]))};
}

/// Precondition: the response has no refusal, and came from this channel of the run.
std::string catheter_page(const runfile::RecordedRun& run, const std::string& channel,
                          const signal::CatheterResponse& response) {
  report::Page page("Frequency response of a catheter");
  page.headline("flat to (-3 dB)", with_error(response.minus_3dB_Hz.value, response.minus_3dB_Hz.se) + " Hz",
                fmt::format("95 % interval {} to {} Hz", number(response.minus_3dB_Hz.ci95[0]),
                            number(response.minus_3dB_Hz.ci95[1])));
  page.headline("lag 5 % of the period at",
                with_error(response.lag_limit_Hz.value, response.lag_limit_Hz.se) + " Hz",
                fmt::format("slow signals come {} ms late", number(1e3 * response.delay_s.value, 3)));
  page.section("The step response",
               fmt::format("{}, channel {}: {} step{} of pressure, each fitted by the response of "
                           "a second-order system.",
                           std::filesystem::path(run.file).filename().string(), channel,
                           response.steps.size(), response.steps.size() == 1 ? "" : "s"));
  for (const std::string& remark : response.remarks)
    page.warning(remark);
  for (const signal::FittedStep& step : response.steps)
    add_step(page, run, channel, step);
  page.section("Frequency response", "What follows from natural frequency and damping ratio.");
  add_response(page, response);
  page.table({"", "value", "95 % interval"},
             {row_of("natural frequency (Hz)", response.f0_Hz), row_of("damping ratio", response.zeta),
              row_of("amplitude -3 dB at (Hz)", response.minus_3dB_Hz),
              row_of("lag 5 % of the period at (Hz)", response.lag_limit_Hz),
              row_of("amplitude 5 % off at (Hz)", response.flat_limit_Hz),
              row_of("delay of slow signals (ms)", response.delay_s, 1e3)},
             "Intervals account for noise that is correlated from sample to sample.");
  return page.html();
}

struct CatheterOptions {
  std::filesystem::path run;
  std::filesystem::path page;
  std::string channel = "cavity_kPa";
  bool force = false;
};

Json as_json(const CatheterOptions& options, const CatheterResponse& response) {
  Json document{{"run", options.run.string()},
                {"channel", options.channel},
                {"f0_Hz", written(response.f0_Hz)},
                {"zeta", written(response.zeta)},
                {"minus_3dB_Hz", written(response.minus_3dB_Hz)},
                {"lag_5_percent_Hz", written(response.lag_limit_Hz)},
                {"flat_5_percent_Hz", written(response.flat_limit_Hz)},
                {"delay_s", written(response.delay_s)},
                {"steps", written(response.steps)},
                {"remarks", response.remarks}};
  if (!options.page.empty()) document["page"] = options.page.string();
  return document;
}

void show(const CatheterResponse& response) {
  const auto row = [](const char* name, const Estimate& estimate, const char* unit, double scale = 1) {
    fmt::print("  {:32} {} {} (95 %: {} to {})\n", name,
               report::with_error(scale * estimate.value, scale * estimate.se), unit,
               report::number(scale * estimate.ci95[0]), report::number(scale * estimate.ci95[1]));
  };
  for (const signal::FittedStep& step : response.steps) {
    fmt::print("step of {:.3f} kPa at {:.3f} s: the fit leaves {:.1f} Pa, the noise before it is {:.1f} Pa\n",
               step.jump_kPa, step.time_s, 1e3 * step.rms_kPa, 1e3 * step.noise_kPa);
  }
  row("natural frequency", response.f0_Hz, "Hz");
  row("damping ratio", response.zeta, "");
  row("amplitude -3 dB at", response.minus_3dB_Hz, "Hz");
  row("lag 5 % of the period at", response.lag_limit_Hz, "Hz");
  row("amplitude 5 % off at", response.flat_limit_Hz, "Hz");
  row("delay of slow signals", response.delay_s, "ms", 1e3);
  fmt::print(
      "In the rig file's [rig], so that later runs know their catheter:\n  catheter_f0_Hz = {:.1f}\n"
      "  catheter_zeta = {:.3f}\n",
      response.f0_Hz.value, response.zeta.value);
}

ExitCode catheter(const CatheterOptions& options, const CommandOutput& out) {
  if (!options.page.empty()) require_output({options.page, {options.run}, report::page_mark, options.force});
  const runfile::RecordedRun run = runfile::read_run(options.run);
  const auto channel = run.pressure.channels.find(options.channel);
  if (channel == run.pressure.channels.end()) {
    throw InputError({run.file, fmt::format("dataset /pressure/{}", options.channel), "is not in this run",
                      "`diastole inspect` lists the channels."});
  }
  const CatheterResponse response = signal::fit_catheter(run.pressure.time_s, channel->second);
  if (!response.refusal.empty()) {
    throw InputError(
        {run.file, fmt::format("dataset /pressure/{}", options.channel), response.refusal,
         "Record a pop test: half a second of quiet, a sudden change of pressure at the catheter's tip "
         "(a balloon that bursts), half a second of quiet; several times if you can."});
  }
  for (const std::string& remark : response.remarks)
    fmt::print(stderr, "{}\n", remark);
  if (!options.page.empty()) write_whole_file(options.page, catheter_page(run, options.channel, response));
  if (out.json) {
    std::cout << json_text(as_json(options, response), 2) << '\n';
    return ExitCode::done;
  }
  show(response);
  if (!options.page.empty()) fmt::print("The plots are in {}\n", options.page.string());
  return ExitCode::done;
}

}  // namespace

void add_catheter(CommandLine& line) {
  auto options = std::make_shared<CatheterOptions>();
  CLI::App* command = line.add(
      "catheter", "frequency response of catheter and transducer, from a recorded step of pressure",
      "  diastole catheter pop.run.h5\n"
      "      natural frequency, damping ratio, the frequencies to which amplitude and lag can be trusted\n"
      "  diastole catheter pop.run.h5 -o catheter.html --json\n"
      "      with plots of each step, its fit and what the fit leaves\n"
      "A pop test is recorded with an experiment that only holds: a balloon over the catheter's tip bursts\n"
      "meanwhile, once or several times.");
  command->add_option("RUN", options->run, "run file with one or more steps")->required();
  command->add_option("-o,--output", options->page, "HTML page with plots to write");
  command->add_option("--channel", options->channel, "pressure channel");
  command->add_flag("--force", options->force, "replace an output file that is no report");
  line.on_run(command, [options](const CommandOutput& out) { return catheter(*options, out); });
}

}  // namespace diastole
