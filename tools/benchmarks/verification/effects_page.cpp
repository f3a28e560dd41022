#include "tools/benchmarks/verification/effects_page.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "estimator/effects/effect.hpp"

namespace diastole {
namespace {

constexpr std::string_view introduction =
    R"(# Effects

What a real rig may have that the base model ([rig-model.md](rig-model.md)) has not. `diastole effects` lists them,
`diastole effects ID` shows one; this page is made of their declarations by `build/release/bin/effects_table`. At its
neutral values each effect is the base model exactly. To add one: [effect.hpp](../estimator/effects/effect.hpp). Gel is the
neo-Hookean annulus between held plates, other specimens are all that `fit` takes besides ([explain-field.md](explain-field.md)).

| effect | port | |
|---|---|---|
)";

std::string others(std::string_view what, std::span<const std::string_view> ids) {
  return ids.empty() ? "" : fmt::format("- {}: `{}`\n", what, fmt::join(ids, "`, `"));
}

std::string table(std::string_view title, std::span<const EffectParameter> parameters) {
  if (parameters.empty()) return "";
  std::string text = fmt::format("\n| {} | unit | neutral | bounds | |\n|---|---|---|---|---|\n", title);
  for (const EffectParameter& parameter : parameters)
    text += fmt::format("| `{}` | {} | {:g} | {:g} to {:g} | {} |\n", parameter.name, parameter.unit,
                        parameter.neutral, parameter.lower, parameter.upper, parameter.meaning);
  return text;
}

std::string section(const Effect& effect) {
  const EffectDeclaration& text = effect.text();
  return fmt::format(
             "\n## `{}`\n\n{} ({}).\n\n- Equations: {}\n- Source: {}\n- Looks like: {}\n- Revealed by: {}\n",
             text.id, text.title, name_of(text.port), text.equations, text.source, text.looks_like,
             text.revealed_by) +
         others("Looks alike in some data", text.conflicts) +
         others("Shows only or better with", text.synergies) + table("parameter", effect.parameters()) +
         table(fmt::format("parameter in {}", name_of(text.field_specimen)), effect.field_parameters());
}

}  // namespace

std::string effects_page() {
  std::string page(introduction);
  for (const Effect* effect : all_effects())
    page += fmt::format("| [`{0}`](#{0}) | {1} | {2} |\n", effect->text().id, name_of(effect->text().port),
                        effect->text().title);
  for (const Effect* effect : all_effects())
    page += section(*effect);
  return page;
}

}  // namespace diastole
