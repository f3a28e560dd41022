#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/interruption.hpp"
#include "estimator/effects/file_effect.hpp"
#include "estimator/explain/rig/effect_trial.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/contract/named_members.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole {
namespace {

nlohmann::ordered_json to_json(std::span<const EffectParameter> parameters) {
  auto list = nlohmann::ordered_json::array();
  for (const EffectParameter& parameter : parameters) {
    list.push_back({DIASTOLE_NAMED(parameter, name, unit, meaning, neutral),
                    {"bounds", {parameter.lower, parameter.upper}}});
  }
  return list;
}

nlohmann::ordered_json to_json(const Effect& effect) {
  const EffectDeclaration& text = effect.text();
  return {DIASTOLE_NAMED(text, id, title),
          {"port", name_of(text.port)},
          DIASTOLE_NAMED(text, equations, source, looks_like, revealed_by, conflicts, synergies),
          {"parameters", to_json(effect.parameters())},
          {"field_parameters", to_json(effect.field_parameters())}};
}

std::string joined(const std::vector<std::string_view>& ids) {
  return fmt::format("{}", fmt::join(ids, ", "));
}

std::string_view words_of(SearchScale scale) {
  if (scale == SearchScale::linear) return "";
  return scale == SearchScale::logarithmic ? ", searched by its logarithm"
                                           : ", searched by its inverse square";
}

void print_for_people(std::string_view title, std::span<const EffectParameter> parameters) {
  if (parameters.empty()) return;
  fmt::print("\n  {}\n", title);
  for (const EffectParameter& parameter : parameters) {
    fmt::print("    {:<28} {}{}neutral {:g}, from {:g} to {:g}{}{}{}\n", parameter.name, parameter.meaning,
               parameter.meaning.empty() ? "" : "; ", parameter.neutral, parameter.lower, parameter.upper,
               parameter.unit.empty() ? "" : " ", parameter.unit, words_of(parameter.scale));
  }
}

void print_for_people(const Effect& effect) {
  const EffectDeclaration& text = effect.text();
  fmt::print("{}: {} (port: {})\n\n", text.id, text.title, name_of(text.port));
  fmt::print("  Equations    {}\n  Source       {}\n  Looks like   {}\n  Revealed by  {}\n", text.equations,
             text.source, text.looks_like, text.revealed_by);
  if (!text.conflicts.empty()) fmt::print("  Looks alike  {}\n", joined(text.conflicts));
  if (!text.synergies.empty()) fmt::print("  Shows with   {}\n", joined(text.synergies));
  print_for_people("Parameters", effect.parameters());
  print_for_people(fmt::format("Parameters in {}", name_of(text.field_specimen)), effect.field_parameters());
}

struct StoppedTrial {};

std::vector<std::string> built_in_ids() {
  std::vector<std::string> ids;
  for (const Effect* effect : all_effects())
    ids.emplace_back(effect->text().id);
  return ids;
}

const Effect& known(const std::string& id) {
  if (const Effect* effect = find_effect(id)) return *effect;
  const std::vector<std::string> ids = built_in_ids();
  throw InputError({"", "ID", fmt::format("there is no effect \"{}\"", id),
                    did_you_mean(id, ids) + "`diastole effects` lists them."});
}

bool is_file(const std::string& id) { return id.ends_with(".toml") || id.find('/') != std::string::npos; }

/// Ids may be those of other files.
void remark_on_ids(const std::string& file, const EffectDeclaration& text) {
  for (const auto& [ids, key] : {std::pair{&text.conflicts, "looks_alike"}, {&text.synergies, "shows_with"}})
    for (const std::string_view id : *ids)
      if (find_effect(id) == nullptr)
        fmt::print(stderr,
                   "{}: key text.{}: no built-in effect is called \"{}\". {}Correct it, unless it is another "
                   "file's.\n",
                   file, key, id, did_you_mean(id, built_in_ids()));
}

/// A file's effect with the checks that every effect must pass.
ExitCode check_file(const std::string& file, size_t threads, const CommandOutput& out) {
  const std::shared_ptr<const Effect> effect = read_effect(file);
  remark_on_ids(file, effect->text());
  if (!out.json) print_for_people(*effect);
  const Interruption interruption;
  std::vector<explain::EffectCheck> checks;
  try {
    checks = explain::EffectTrial(*effect, threads).all([](const std::string& what) {
      if (Interruption::requested()) throw StoppedTrial{};
      fmt::print(stderr, "effects: trying {}\n", what);
    });
  } catch (const StoppedTrial&) {
    std::cerr << "diastole effects: interrupted\n";
    return ExitCode::negative;
  }
  if (out.json) {
    nlohmann::ordered_json json;
    json["effects"].push_back(to_json(*effect));
    for (const explain::EffectCheck& check : checks)
      json["checks"].push_back({{"outcome", check.outcome()}, DIASTOLE_NAMED(check, name, passed, detail)});
    std::cout << json_text(json, 1) << '\n';
  } else {
    fmt::print("\n  Checks\n");
    for (const explain::EffectCheck& check : checks)
      fmt::print("    {:<22}{:<8}{}\n", check.name, check.outcome(), check.detail);
  }
  return std::ranges::all_of(checks, &explain::EffectCheck::passed) ? ExitCode::done : ExitCode::negative;
}

ExitCode run_effects(const std::string& id, size_t threads, const CommandOutput& out) {
  if (is_file(id)) return check_file(id, threads, out);
  std::vector<const Effect*> chosen = all_effects();
  if (!id.empty()) chosen = {&known(id)};
  if (out.json) {
    nlohmann::ordered_json json;
    for (const Effect* effect : chosen)
      json["effects"].push_back(to_json(*effect));
    std::cout << json_text(json, 1) << '\n';
  } else if (!id.empty()) {
    print_for_people(*chosen.front());
  } else {
    for (const Effect* effect : chosen)
      fmt::print("{:<24}{:<10}{}\n", effect->text().id, name_of(effect->text().port), effect->text().title);
  }
  return ExitCode::done;
}

}  // namespace

void add_effects(CommandLine& line) {
  auto id = std::make_shared<std::string>();
  auto threads = std::make_shared<size_t>(2);
  CLI::App* command = line.add(
      "effects", "what a real rig may have that the model has not: the effects that are known, and your own",
      "  diastole effects\n  diastole effects hose-compliance\n  diastole effects --json\n"
      "  diastole effects my-seal.effect.toml     a hypothesis of your own: printed and checked\n"
      "Without ID all are listed; with it, equations, parameters, what it looks like and which experiment "
      "reveals it.\n"
      "A file's formulas are read with their units; then it is tried as every effect is: neutral value, "
      "bounds, "
      "derivatives,\n"
      "found again in simulated data, silent without cause. Exit code 1: a check failed; 2: the file is "
      "none. "
      "`diastole\n"
      "explain --with FILE` lets it compete. docs/effects-as-files.md says how such a file is written.");
  command->add_option("ID", *id, "an effect, for example hose-compliance, or a file NAME.effect.toml");
  command->add_option("--threads", *threads, "simulations at a time")
      ->check(number_between(1, 256))
      ->capture_default_str();
  line.on_run(command, [id, threads](const CommandOutput& out) { return run_effects(*id, *threads, out); });
}

}  // namespace diastole
