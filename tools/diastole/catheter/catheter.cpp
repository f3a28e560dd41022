#include "tools/diastole/catheter/catheter.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <memory>

#include "estimator/catheter/step_fit.hpp"
#include "estimator/io/member_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/page.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/reader.hpp"
#include "tools/diastole/catheter/catheter_page.hpp"

namespace diastole {
namespace signal {

DIASTOLE_MEMBERS(Estimate, value, se, ci95)
DIASTOLE_MEMBERS(FittedStep, time_s, before_kPa, jump_kPa, f0_Hz, zeta, rms_kPa, noise_kPa)

}  // namespace signal

namespace {

using signal::CatheterResponse;
using signal::Estimate;

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
    std::cout << as_json(options, response).dump(2) << '\n';
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
