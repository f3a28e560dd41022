#include <fmt/format.h>

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "estimator/cli/commands.hpp"
#include "estimator/effects/effect.hpp"
#include "protocol/contract/input_error.hpp"
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

void print_for_people(std::string_view title, std::span<const EffectParameter> parameters) {
  if (parameters.empty()) return;
  fmt::print("\n  {}\n", title);
  for (const EffectParameter& parameter : parameters) {
    fmt::print("    {:<28} {}; neutral {:g}, from {:g} to {:g}\n", parameter.name, parameter.meaning,
               parameter.neutral, parameter.lower, parameter.upper);
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
  print_for_people("Parameters in images", effect.field_parameters());
}

const Effect& known(const std::string& id) {
  if (const Effect* effect = find_effect(id)) return *effect;
  std::vector<std::string> ids;
  for (const Effect* effect : all_effects())
    ids.emplace_back(effect->text().id);
  throw InputError({"", "ID", fmt::format("there is no effect \"{}\"", id),
                    did_you_mean(id, ids) + "`diastole effects` lists them."});
}

ExitCode run_effects(const std::string& id, const CommandOutput& out) {
  std::vector<const Effect*> chosen = all_effects();
  if (!id.empty()) chosen = {&known(id)};
  if (out.json) {
    nlohmann::ordered_json json;
    for (const Effect* effect : chosen)
      json["effects"].push_back(to_json(*effect));
    std::cout << json.dump(1) << '\n';
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
  CLI::App* command = line.add(
      "effects", "what a real rig may have that the model has not: the effects that are known",
      "  diastole effects\n  diastole effects hose-compliance\n  diastole effects --json\n"
      "Without ID all are listed; with it, equations, parameters, what it looks like and which experiment "
      "reveals it.");
  command->add_option("ID", *id, "an effect, for example hose-compliance");
  line.on_run(command, [id](const CommandOutput& out) { return run_effects(*id, out); });
}

}  // namespace diastole
