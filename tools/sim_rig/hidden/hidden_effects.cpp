#include "tools/sim_rig/hidden/hidden_effects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole::sim_rig {

namespace hidden {
#define DIASTOLE_HIDDEN(function, id, port) void function(Draw& draw);
#include "tools/sim_rig/hidden/hidden_list.inc"
#undef DIASTOLE_HIDDEN
}  // namespace hidden

namespace {

constexpr std::array kinds{
#define DIASTOLE_HIDDEN(function, id, port) HiddenKind{id, port, hidden::function},
#include "tools/sim_rig/hidden/hidden_list.inc"
#undef DIASTOLE_HIDDEN
};

const HiddenKind& kind_named(const std::string& id) {
  const auto* found = std::ranges::find(kinds, id, &HiddenKind::id);
  if (found != kinds.end()) return *found;
  std::vector<std::string> known{"none", "outside", "any"};
  for (const HiddenKind& kind : kinds)
    known.emplace_back(kind.id);
  throw InputError({"", "option --hide", fmt::format("\"{}\" is no effect that can be hidden", id),
                    did_you_mean(id, known) + "`sim_rig hidden` lists all."});
}

/// A seed's first choice, apart from the sizes.
std::vector<const HiddenKind*> chosen(const std::vector<std::string>& ids, std::mt19937_64& random) {
  std::vector<const HiddenKind*> known, outside, result;
  for (const HiddenKind& kind : kinds)
    (kind.is_outside() ? outside : known).push_back(&kind);
  const auto one_of = [&](const auto& list) { return list[random() % list.size()]; };
  for (const std::string& id : ids) {
    if (id == "none") continue;
    if (id == "outside") {
      result.push_back(one_of(outside));
    } else if (id == "any") {
      const uint64_t lot = random() % 10;  // 2 nothing, 5 one, 2 two, 1 of no library
      if (lot >= 2 && lot < 9) result.push_back(one_of(known));
      if (lot == 7 || lot == 8) {
        const HiddenKind* second = one_of(known);
        if (second != result.back()) result.push_back(second);
      }
      if (lot == 9) result.push_back(one_of(outside));
    } else {
      result.push_back(&kind_named(id));
    }
  }
  return result;
}

std::string_view kind_of(const std::vector<const HiddenKind*>& put) {
  if (put.empty()) return "none";
  if (std::ranges::any_of(put, [](const HiddenKind* kind) { return kind->is_outside(); })) return "outside";
  return put.size() == 1 ? "single" : "pair";
}

}  // namespace

double Draw::even() {
  constexpr double whole = 18446744073709551616.0;  // 2^64
  return static_cast<double>(random_()) / whole;
}

double Draw::within(const std::string& name, double low, double high) {
  return drawn[name] = low * std::pow(high / low, even());
}

double Draw::either_sign(const std::string& name, double low, double high) {
  const double sign = even() < 0.5 ? -1.0 : 1.0;
  return drawn[name] = sign * within(name, low, high);
}

int Draw::whole(const std::string& name, int low, int high) {
  const int value = std::min(high, low + static_cast<int>(even() * (high - low + 1)));
  drawn[name] = value;
  return value;
}

std::span<const HiddenKind> hidden_kinds() { return kinds; }

std::string hide(const std::vector<std::string>& ids, uint64_t seed, PlantConfig& plant) {
  std::mt19937_64 random(seed);
  const std::vector<const HiddenKind*> put = chosen(ids, random);
  nlohmann::ordered_json json = {{"format", "diastole-sealed"},
                                 {"format_version", 1},
                                 {"seed", seed},
                                 {"kind", kind_of(put)},
                                 {"truth", nlohmann::ordered_json::array()}};
  for (const HiddenKind* kind : put) {
    Draw draw(plant, random());
    kind->put(draw);
    json["truth"].push_back({{"id", kind->id}, {"port", kind->port}, {"parameters", draw.drawn}});
  }
  return json.dump(1) + "\n";
}

std::string list_of_hidden() {
  std::string text;
  for (const HiddenKind& kind : kinds)
    text += fmt::format("{:24} {}\n", kind.id, kind.port);
  return text + "none, outside (one of no library), any (nothing, one, two or one of no library)\n";
}

}  // namespace diastole::sim_rig
