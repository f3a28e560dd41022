#include <fmt/format.h>

#include <iostream>
#include <memory>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/interruption.hpp"
#include "estimator/explain/rig/reference_json.hpp"
#include "estimator/io/study.hpp"
#include "estimator/io/study_fingerprint.hpp"
#include "estimator/io/whole_file.hpp"

namespace diastole {
namespace {

constexpr std::string_view reference_mark = "diastole-reference";

struct ReferenceArguments {
  std::vector<std::filesystem::path> studies;
  std::filesystem::path output;
  size_t threads = 2;
  bool force = false;
};

struct ReferenceInterrupted {};

void print_reference(const explain::Reference& reference, const std::filesystem::path& output) {
  fmt::print("{} of a rig in which nothing is wrong: what its model misses by itself\n\n",
             reference.sessions == 1 ? "One session" : fmt::format("{} sessions", reference.sessions));
  for (size_t s = 0; s < rig::signal_count; ++s) {
    if (reference.rms[s] == 0.0) continue;
    const auto signal = static_cast<rig::Signal>(s);
    const bool volume = signal == rig::Signal::volume;
    fmt::print("  {:<12} {:>8.1f} {}   {:.2f} % of the range\n", rig::name_of(signal),
               reference.rms[s] * (volume ? 1.0 : 1e3), volume ? "mL" : "Pa", reference.percent_of_range[s]);
  }
  std::string departures;
  for (size_t i = 0; i < reference.tolerances.size(); ++i)
    if (const double mean = reference.mean[static_cast<Eigen::Index>(i)]; std::abs(mean) > 2.0)
      departures += fmt::format("    {:<22} {:+.1f}\n", reference.tolerances[i], mean);
  if (!departures.empty())
    fmt::print(
        "\n  tolerances that differ from what /rig states by more than two of their standard deviations\n{}",
        departures);
  fmt::print("\nIn {}. A study of this rig names it: [data] reference = [\"{}\"]\n", output.string(),
             output.filename().string());
}

ExitCode run_reference(const ReferenceArguments& arguments, const CommandOutput& out) {
  std::vector<std::filesystem::path> inputs;
  std::string fingerprints;
  std::vector<Study> studies;
  for (const std::filesystem::path& file : arguments.studies) {
    const Study& study = studies.emplace_back(read_study(file));
    for (const std::filesystem::path& input : inputs_of(study))
      inputs.push_back(input);
    fingerprints += (fingerprints.empty() ? "" : "-") + study_fingerprint(study);
  }
  require_output({arguments.output, inputs, reference_mark, arguments.force});
  const Interruption interruption;
  try {
    explain::Reference reference =
        explain::learn_reference(studies, arguments.threads, [](std::string_view what) {
          if (Interruption::requested()) throw ReferenceInterrupted{};
          fmt::print(stderr, "reference: {}\n", what);
        });
    reference.fingerprint = fingerprints;
    // A fit without a result leaves no numbers: nothing that a file could hold.
    const bool has_numbers = reference.mean.allFinite() && reference.covariance.allFinite();
    if (has_numbers) {
      const std::string text = explain::to_json(reference);
      write_whole_file(arguments.output, text);
      if (out.json) {
        std::cout << text;
      } else {
        print_reference(reference, arguments.output);
      }
    }
    if (!has_numbers || !inference::is_settled(reference.termination)) {
      fmt::print(stderr,
                 "diastole reference: a session's fit did not settle, so that nothing can be named with this "
                 "reference{}. {}\n"
                 "  Leave sessions out one by one to find which; something may be wrong in it: `diastole "
                 "inspect RUN` "
                 "shows what was recorded.\n",
                 has_numbers ? "" : ", and it is not written", inference::sentence(reference.termination));
      return ExitCode::negative;
    }
  } catch (const ReferenceInterrupted&) {
    std::cerr << "diastole reference: interrupted; nothing was written\n";
    return ExitCode::negative;
  }
  return ExitCode::done;
}

}  // namespace

void add_reference(CommandLine& line) {
  auto arguments = std::make_shared<ReferenceArguments>();
  CLI::App* command =
      line.add("reference", "what a rig's model misses by itself, from sessions in which nothing is wrong",
               "  diastole reference ref-1/ref-1.study.toml ref-2/ref-2.study.toml -o rig.reference.json\n"
               "The rig's model is fitted to each session: what its description does not tell exactly "
               "(lengths, losses,\n"
               "lags, a gel's relaxation) becomes known, and what all of them leave in common is the rig's "
               "own misfit.\n"
               "Specimens may be other castings than later ones; narrow bounds of the modulus (within a "
               "quarter) state\n"
               "that it was measured. Two references tell how far the misfit comes again, one does not.\n"
               "A study of the same rig then says [data] reference = [\"rig.reference.json\"], and `diastole "
               "explain`\n"
               "answers what differs from the rig as commissioned.");
  command->add_option("STUDY", arguments->studies, "study files with [data] runs")->required();
  command->add_option("-o,--output", arguments->output, "file for the result, rig.reference.json say")
      ->required();
  command->add_option("--threads", arguments->threads, "simulations at a time")
      ->check(number_between(1, 256))
      ->capture_default_str();
  command->add_flag("--force", arguments->force, "replace a file that holds something else");
  line.on_run(command, [arguments](const CommandOutput& out) { return run_reference(*arguments, out); });
}

}  // namespace diastole
