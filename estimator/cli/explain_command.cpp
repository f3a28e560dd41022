#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/interruption.hpp"
#include "estimator/cli/output_files.hpp"
#include "estimator/cli/study_images.hpp"
#include "estimator/explain/explain_study.hpp"
#include "estimator/explain/verdict/explained_study.hpp"
#include "estimator/explain/verdict/explanation_json.hpp"
#include "estimator/explain/verdict/learned_file.hpp"
#include "estimator/explain/verdict/verdict.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/model/study_effects.hpp"
#include "estimator/reconstruction/study_reconstruction.hpp"
#include "estimator/report/page.hpp"
#include "estimator/report/report.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view explanation_file = "explanation.json";
constexpr std::string_view study_file = "explained.study.toml";
constexpr std::string_view report_file = "report.html";
constexpr std::string_view study_mark = "# Written by diastole explain";

struct ExplainArguments {
  fs::path study;  ///< or, with `truths`, the folder of explanations
  fs::path folder;
  fs::path truths;
  std::vector<fs::path> with;  ///< the user's own effects
  size_t threads = 2;
  bool force = false;
  bool learn = false;   ///< a term beside what is named or open, too
  bool strict = false;  ///< an answer that is no clear one is a failure
  bool unexamined = false;
};

void print_progress(const std::string& text) {
  if (Interruption::requested()) throw explain::Interrupted{};
  if (!text.empty()) fmt::print(stderr, "explain: {}\n", text);
}

std::string with_units(const explain::FoundParameter& parameter) {
  return fmt::format("    {:<28} {:.6g}{}{}   (90 %: {:.6g} to {:.6g})\n", parameter.name, parameter.value,
                     parameter.unit.empty() ? "" : " ", parameter.unit, parameter.ci90[0], parameter.ci90[1]);
}

std::string place_of(const explain::Misfit& misfit) {
  std::string text = fmt::format("  {:<9} {}", misfit.port, misfit.channel);
  if (!misfit.run.empty()) text += " of " + misfit.run;
  if (!misfit.region.empty()) text += ", " + misfit.region;
  if (misfit.segment) text += fmt::format(", segment {}", *misfit.segment);
  if (misfit.phase) text += fmt::format(", phase {:.1f} to {:.1f}", (*misfit.phase)[0], (*misfit.phase)[1]);
  if (misfit.band_Hz) text += fmt::format(", {:g} to {:g} Hz", (*misfit.band_Hz)[0], (*misfit.band_Hz)[1]);
  return text + fmt::format(": {:.0f} above what noise and the model's error give\n", misfit.excess_chi2);
}

void print_learned(const explain::LearnedTerm& term) {
  fmt::print("\nLearnt, a suggestion: {}\n", place_of(term));
  for (const std::string& reading : term.readings)
    fmt::print("  {}\n", reading);
  if (!term.closed_form.empty()) fmt::print("  within its band: {}\n", term.closed_form);
  fmt::print("  reduced chi-square on waveforms that were not fitted: {:.3g} without, {:.3g} with it\n",
             term.gap.before, term.gap.after);
  for (const explain::ParameterShift& shift : term.shifts)
    fmt::print("  {:<18} {:.4f} +- {:.4f} without, {:.4f} +- {:.4f} with it\n", shift.name, shift.before,
               shift.before_error, shift.after, shift.after_error);
  for (const explain::LearnedRival& rival : term.rivals)
    fmt::print("  as good: {}, at the port {}, {} by {}\n", rival.effect_file, rival.port, rival.sets,
               fmt::join(rival.variables, " and "));
}

void print_for_people(const explain::Explanation& found, const fs::path& folder) {
  fmt::print("{}\n\n  verdict: {}{}\n", found.summary, explain::name_of(found.verdict),
             found.confidence ? fmt::format(" (confidence {:.3g})", *found.confidence) : "");
  if (found.model_error)
    fmt::print("  the model's own error in the cavity: {:.1f} Pa, {:.2f} % of the range ({})\n",
               found.model_error->rms_Pa, found.model_error->percent_of_range, found.model_error->source);
  for (const explain::FoundEffect& effect : found.effects) {
    fmt::print("  {}{}\n", effect.id,
               effect.size_over_model_error
                   ? fmt::format("   {:.1f} times the model's own error", *effect.size_over_model_error)
                   : "");
    for (const explain::FoundParameter& parameter : effect.parameters)
      fmt::print("{}", with_units(parameter));
    for (const explain::FoundChangePoint& at : effect.change_points)
      fmt::print("    at {:.3f} s of {}\n", at.time_s, at.run);
  }
  for (const explain::Hint& hint : found.hints)
    fmt::print("  hint: {}, {:.1f} times the model's own error: too small for a name\n", hint.id,
               hint.size_over_model_error);
  if (!found.where.empty()) fmt::print("\nWhere the model fails\n");
  for (const explain::Misfit& misfit : found.where)
    fmt::print("{}", place_of(misfit));
  fmt::print(
      "\nReduced chi-square on data that were not fitted: {:.3f} before, {:.3f} after, {:.3f} without any "
      "error.\n",
      found.gap.before, found.gap.after, found.gap.floor);
  for (const explain::ParameterShift& shift : found.shifts)
    fmt::print("  {:<18} {:.4f} +- {:.4f} without, {:.4f} +- {:.4f} with what was found\n", shift.name,
               shift.before, shift.before_error, shift.after, shift.after_error);
  if (found.learned) print_learned(*found.learned);
  if (!found.not_learned.empty()) fmt::print("\nNo law was learnt: {}.\n", found.not_learned);
  if (found.next_experiment) fmt::print("\nNext: {}\n", found.next_experiment->reason);
  fmt::print("\nIn {}: {}, {}{}{}\n", folder.string(), explanation_file, report_file,
             found.study_after.empty() ? "" : fmt::format(", {}", found.study_after),
             found.learned ? fmt::format(", {}", found.learned->effect_file) : "");
}

/// A folder that was made for results: gone again if nothing was written into it.
struct MadeFolder {
  fs::path made = {};

  MadeFolder() = default;
  MadeFolder(const MadeFolder&) = delete;
  MadeFolder& operator=(const MadeFolder&) = delete;
  ~MadeFolder() {
    std::error_code not_empty;
    if (!made.empty()) fs::remove(made, not_empty);
  }
};

/// Whether a study's tags and points can be what they say; what is wrong with them is printed as `fit` prints it.
bool can_be_true(const Study& study) {
  print_progress("examining the data; --unexamined skips that");
  const std::vector<Finding> findings = examine_measurement(study, read_measurement(study));
  print_findings(findings, stderr);
  if (!has_error(findings)) return true;
  std::cerr << "diastole explain: the data cannot be what they say. `diastole reconstruct` shows them; "
               "--unexamined explains them nevertheless.\n";
  return false;
}

/// Values that the recordings ask for and the study forbids.
void remark_on_bounds(const Study& study, const explain::Explanation& found) {
  for (const StudyParameter& stated : study.law.parameters) {
    const auto seen = std::ranges::find(found.shifts, stated.name, &explain::ParameterShift::name);
    if (seen != found.shifts.end() && (seen->after < stated.lower || seen->after > stated.upper))
      fmt::print(stderr,
                 "{}: {} is {:.4g} by these recordings, outside its bounds [{:g}, {:g}]. Check its unit, or "
                 "widen them.\n",
                 study.file.string(), stated.name, seen->after, stated.lower, stated.upper);
  }
}

struct ExplanationFiles {
  fs::path folder;
  fs::path json = folder / explanation_file, study = folder / study_file, page = folder / report_file;
  /// Of the best learned law (0) and its rivals.
  [[nodiscard]] fs::path learned(size_t law) const { return folder / explain::learned_file_name(law); }
};

/// The best law and its rivals; files of an earlier explanation go. The explanation gets the names.
void write_learned(explain::Explanation& found, const ExplanationFiles& files) {
  const auto write = [&](size_t law, std::string& name, const std::string& toml) {
    name = explain::learned_file_name(law).string();
    explain::write_learned_file(files.learned(law), toml);
  };
  size_t written = 0;
  if (found.learned) {
    write(written++, found.learned->effect_file, found.learned->toml);
    for (explain::LearnedRival& rival : found.learned->rivals)
      write(written++, rival.effect_file, rival.toml);
  }
  for (size_t law = written; law < explain::most_learned_laws; ++law)
    explain::remove_learned_file(files.learned(law));
}

/// The explanation gets the files' names.
void write_explanation(const Study& study, explain::Explanation& found, const ExplanationFiles& files) {
  std::error_code missing;
  if (!found.effects.empty()) {
    found.study_after = study_file;
    write_whole_file(files.study,
                     fmt::format("{}: {}.\n", study_mark, explain::name_of(found.verdict)) +
                         explain::explained_study(study, files.folder, found.effects, found.shifts));
  } else {
    fs::remove(files.study, missing);  // of an earlier explanation
  }
  write_learned(found, files);
  write_whole_file(files.json, explain::to_json(found));
  write_whole_file(files.page, report::make_report(found));
}

ExitCode run_explain(const ExplainArguments& arguments, const CommandOutput& out) {
  Study study = read_study(arguments.study);
  if (arguments.folder.empty()) {
    throw InputError({"", "option -o", "is missing", "Name a folder for the result: -o out/."});
  }
  use_images(study);
  study.effect_files.insert(study.effect_files.end(), arguments.with.begin(), arguments.with.end());
  effects_known_to(study);  // refuses what is no effect before the folder is made
  const ExplanationFiles files{arguments.folder};
  std::error_code error;
  MadeFolder folder;
  if (fs::create_directories(arguments.folder, error)) folder.made = arguments.folder;
  if (error) {
    throw InputError({arguments.folder.string(), "-o",
                      fmt::format("the folder cannot be made: {}", error.message()),
                      "Name a folder that you may write."});
  }
  require_output({files.json, inputs_of(study), explain::explanation_file_mark, arguments.force});
  require_output({files.study, inputs_of(study), study_mark, arguments.force});
  require_output({files.page, inputs_of(study), report::page_mark, arguments.force});
  for (size_t law = 0; law < explain::most_learned_laws; ++law)
    explain::require_learned_file(files.learned(law), inputs_of(study), arguments.force);
  const Interruption interruption;
  explain::Explanation found;
  try {
    const bool imaged = study.data.tags || study.data.points;
    if (imaged && !arguments.unexamined && !can_be_true(study)) return ExitCode::negative;
    found = explain::explain_study(study, {.threads = arguments.threads,
                                           .propose = true,
                                           .learn = arguments.learn,
                                           .progress = print_progress});
  } catch (const explain::Interrupted&) {
    std::cerr << "diastole explain: interrupted; nothing was written\n";
    return ExitCode::negative;
  }
  remark_on_bounds(study, found);
  write_explanation(study, found, files);
  if (out.json) {
    explain::Explanation brief = found;
    brief.traces.clear();
    std::cout << explain::to_json(brief);
  } else {
    print_for_people(found, arguments.folder);
  }
  const bool clear = found.verdict == explain::Verdict::named || found.verdict == explain::Verdict::none;
  return arguments.strict && !clear ? ExitCode::negative : ExitCode::done;
}

}  // namespace

void add_explain(CommandLine& line, const ExplanationScorer& score) {
  auto arguments = std::make_shared<ExplainArguments>();
  CLI::App* command = line.add(
      "explain", "where model and recordings disagree, which effect is missing, and what stays open",
      "  diastole explain case.study.toml -o out/\n"
      "  diastole explain case.study.toml -o out/ --json\n"
      "  diastole explain out/explained.study.toml -o further/     what is missing beside what was found\n"
      "  diastole explain case.study.toml --with my-seal.effect.toml -o out/     a hypothesis of your own "
      "beside those that are known\n"
      "  diastole explain case.study.toml --learn -o out/      a law that no effect of the library is, "
      "learnt at "
      "one port\n"
      "  diastole explain --score sealed/ results/                 right how often? "
      "results/NAME/explanation.json\n"
      "      against sealed/NAME.sealed.json (diastole simulate --hide) or a labels.json; exit code 1: false "
      "alarms\n"
      "      where nothing is hidden, or names where nothing known is\n"
      "The verdict is one of\n"
      "  named        one set of effects explains the misfit; its parameters come with 90 % intervals\n"
      "  ambiguous    these data cannot tell several sets apart, or one from nothing\n"
      "  unexplained  the misfit has structure that no known effect removes; where it sits is reported\n"
      "  none         nothing exceeds the model's own error\n"
      "OUT gets report.html, explanation.json for `diastole report`, and explained.study.toml: the study "
      "with\n"
      "what was found; where the verdict is unexplained and a law at one port predicts waveforms that it was "
      "not "
      "fitted to,\n"
      "learned.effect.toml: a suggestion that --with takes once it is read and named, with "
      "learned-2.effect.toml\n"
      "and so on of laws that predict as well; it takes new runs to name it.\n"
      "A name needs an effect larger than the model's own error; smaller ones are hints. That error is "
      "learnt where the\n"
      "study names sessions in which nothing is wrong, [data] reference = [...] (diastole reference "
      "--help).\n"
      "`diastole effects` lists the effects that are known; `diastole effects FILE` checks one of yours. "
      "Exit code 0: done, whatever the verdict; 1: images that cannot be what they say, interrupted before\n"
      "there was a verdict, or with --strict ambiguous or unexplained; 2: unreadable input.");
  command
      ->add_option("STUDY", arguments->study, "study file with [data] runs; with --score the results' folder")
      ->required();
  command->add_option("-o,--output", arguments->folder, "folder for the result; made if it is not there");
  command
      ->add_option("--with", arguments->with,
                   "effects of your own, NAME.effect.toml, that compete with those that are known")
      ->expected(1, CLI::detail::expected_max_vector_size)
      ->check(CLI::ExistingFile);
  command->add_option("--score", arguments->truths, "compare explanations with what was hidden");
  command->add_option("--threads", arguments->threads, "simulations at a time")
      ->check(number_between(1, 256))
      ->capture_default_str();
  command->add_flag(
      "--learn", arguments->learn,
      "learn a law beside what is found, whatever it is, but where nothing is missing; without it only where "
      "the verdict is unexplained");
  command->add_flag("--unexamined", arguments->unexamined,
                    "do not look beforehand for what is wrong with imaged data (docs/reconstruction.md)");
  command->add_flag("--strict", arguments->strict, "exit with 1 if the answer is ambiguous or unexplained");
  command->add_flag("--force", arguments->force, "replace files in the folder that hold something else");
  line.on_run(command, [arguments, score](const CommandOutput& out) {
    if (!arguments->truths.empty()) return score(arguments->truths, arguments->study, out);
    return run_explain(*arguments, out);
  });
}

}  // namespace diastole
