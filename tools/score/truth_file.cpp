#include "tools/score/truth_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::explain {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::string_view sealed_ending = ".sealed.json";

constexpr std::array<std::pair<std::string_view, TruthKind>, 5> kinds{
    {{"none", TruthKind::none},
     {"single", TruthKind::single},
     {"pair", TruthKind::pair},
     {"outside", TruthKind::outside},
     {"inseparable", TruthKind::inseparable}}};

TruthKind kind_named(const std::string& word) {
  for (const auto& [name, kind] : kinds)
    if (name == word) return kind;
  throw std::invalid_argument("\"" + word + "\" is no kind of truth");
}

HiddenEffect hidden_effect(const Json& json) {
  HiddenEffect effect{json.at("id").get<std::string>(), json.value("port", ""), {}};
  const Json parameters = json.value("parameters", Json::object());
  for (const auto& [name, value] : parameters.items())
    if (value.is_number()) effect.parameters[name] = value.get<double>();
  // The model's parameter is the reciprocal of the independent programs'.
  const auto bond = effect.parameters.find("bond_stiffness_kPa_mm");
  if (bond != effect.parameters.end() && bond->second > 0.0)
    effect.parameters["bond_compliance_mm_per_kPa"] = 1.0 / bond->second;
  return effect;
}

constexpr double separable_sigma = 8.0;  // a smaller effect is in the noise

EffectSize size_named(const std::string& word) {
  if (word == "large") return EffectSize::large;
  return word == "medium" ? EffectSize::medium : EffectSize::small;  // "between", "small", "none"
}

Truth rig_truth(const std::string& name, const Json& json) {
  Truth truth;
  truth.name = name;
  truth.kind = kind_named(json.at("kind").get<std::string>());
  for (const Json& effect : json.at("truth"))
    truth.hidden.push_back(hidden_effect(effect));
  if (json.contains("alternatives")) json.at("alternatives").get_to(truth.alternatives);
  if (json.contains("alternatives_without_reference"))
    json.at("alternatives_without_reference").get_to(truth.alternatives_without_reference);
  if (json.contains("d") && json.at("d").is_number()) truth.size_sigma = json.at("d").get<double>();
  if (truth.size_sigma < separable_sigma) truth.size = EffectSize::small;
  if (json.contains("size")) truth.size = size_named(json.at("size").get<std::string>());
  for (const Json& part : json.value("also_present", Json::array()))
    if (part.value("namable", false)) truth.imperfections.push_back(hidden_effect(part));
  return truth;
}

/// One truth a study: with C1 free and with C1 known from a shear test.
std::vector<Truth> field_truths(const std::string& name, const Json& json) {
  std::vector<Truth> truths;
  if (!json.contains("expected")) return truths;
  const Json& expected = json.at("expected");
  for (const auto& [key, suffix] : {std::pair{"C1_free", ""}, std::pair{"C1_known_shear", "-shear"}}) {
    if (!expected.contains(key)) continue;
    Truth truth;
    truth.name = name + suffix;
    for (const Json& word : expected.at(key).at("acceptable_verdicts"))
      truth.acceptable.push_back(verdict_named(word.get<std::string>()));
    truth.size_sigma = std::sqrt(std::max(0.0, expected.at(key).value("excess_chi2", 0.0)));
    const auto accepts = [&](Verdict verdict) { return std::ranges::count(truth.acceptable, verdict) > 0; };
    HiddenEffect effect{json.at("effect").at("id").get<std::string>(), "field", {}};
    for (const auto& [parameter, value] : json.at("effect").items())
      if (value.is_number()) effect.parameters[parameter] = value.get<double>();
    if (accepts(Verdict::unexplained)) {
      truth.kind = TruthKind::outside;
      effect.id = "outside:" + effect.id;
    } else if (accepts(Verdict::named)) {
      truth.kind = TruthKind::single;
    } else {
      truth.kind = accepts(Verdict::ambiguous) ? TruthKind::inseparable : TruthKind::none;
    }
    if (truth.kind != TruthKind::none) truth.hidden.push_back(effect);
    if (accepts(Verdict::ambiguous) && expected.contains("ambiguous_sets"))
      expected.at("ambiguous_sets").get_to(truth.alternatives);
    if (accepts(Verdict::none) && truth.kind != TruthKind::none) truth.alternatives.emplace_back();
    truths.push_back(std::move(truth));
  }
  return truths;
}

std::vector<Truth> truths_of(const fs::path& file) {
  const std::string remedy =
      "Give a labels.json, a NAME.sealed.json of the simulated rig, or a folder of them.";
  try {
    const Json json = Json::parse(read_whole_file(file, remedy));
    if (json.value("format", "") == "diastole-sealed") {
      std::string name = file.filename().string();
      if (name.ends_with(sealed_ending)) name.resize(name.size() - sealed_ending.size());
      return {rig_truth(name, json)};
    }
    const bool fields = json.value("format", "") == "fegen-labels";
    std::vector<Truth> truths;
    for (const auto& [name, value] : (json.contains("cases") ? json.at("cases") : json).items()) {
      if (!fields) {
        truths.push_back(rig_truth(name, value));
        continue;
      }
      for (Truth& truth : field_truths(name, value))
        truths.push_back(std::move(truth));
    }
    return truths;
  } catch (const nlohmann::json::exception& error) {
    throw InputError({file.string(), "", fmt::format("tells no truth: {}", error.what()), remedy});
  } catch (const std::invalid_argument& error) {
    throw InputError({file.string(), "", fmt::format("tells no truth: {}", error.what()), remedy});
  }
}

}  // namespace

std::string_view name_of(TruthKind kind) {
  return std::ranges::find(kinds, kind, &std::pair<std::string_view, TruthKind>::second)->first;
}

std::vector<std::string> Truth::ids() const {
  std::vector<std::string> ids;
  for (const HiddenEffect& effect : hidden)
    ids.push_back(effect.id);
  std::ranges::sort(ids);
  return ids;
}

std::vector<Truth> read_truths(const fs::path& place) {
  if (!fs::is_directory(place)) return truths_of(place);
  if (fs::exists(place / "labels.json")) return truths_of(place / "labels.json");
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(place)) {
    if (entry.path().filename().string().ends_with(sealed_ending)) files.push_back(entry.path());
  }
  if (files.empty()) {
    throw InputError({place.string(), "", "has neither a labels.json nor a NAME.sealed.json",
                      "Give the folder in which the simulated rig left what it hid (--sealed)."});
  }
  std::ranges::sort(files);
  std::vector<Truth> truths;
  for (const fs::path& file : files) {
    for (Truth& truth : truths_of(file))
      truths.push_back(std::move(truth));
  }
  return truths;
}

}  // namespace diastole::explain
