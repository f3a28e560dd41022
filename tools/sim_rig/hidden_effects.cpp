#include "tools/sim_rig/hidden_effects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/contract/table_reader.hpp"
#include "tools/sim_rig/hidden_file.hpp"

namespace diastole::sim_rig {

namespace {

constexpr double kPa_per_Pa = 1e-3;

/// A new one is an entry here. Ids are those of `diastole explain`.
constexpr std::array known_effects{
    HiddenKind{"stroke-gain", "drive",
               [](Draw& draw) { draw.flaws.drive.gain = draw.either_sign("gain", 0.03, 0.1); }},
    HiddenKind{"backlash", "drive",
               [](Draw& draw) { draw.flaws.drive.backlash_mL = draw.within("backlash_mL", 0.1, 0.5); }},
    HiddenKind{"missed-steps", "drive",
               [](Draw& draw) {
                 draw.flaws.drive.missed_in_cycle = draw.whole("cycle", 3, 6);
                 draw.flaws.drive.missed_mL = draw.within("lost_mL", 0.25, 1.0);
               }},
    HiddenKind{"seal-leak-pump", "drive",
               [](Draw& draw) { draw.flaws.pump.leak_mL_s_kPa = draw.within("leak_mL_s_kPa", 0.02, 0.15); }},
    HiddenKind{"air-bubble-pump", "drive",
               [](Draw& draw) { draw.flaws.pump.gas_mL = draw.within("volume_mL", 2.0, 20.0); }},
    HiddenKind{"hose-compliance", "drive",
               [](Draw& draw) {
                 HoseConfig& hose = draw.plant.hose;
                 hose.wave_speed_m_s = draw.within("wave_speed_m_s", 30.0, 120.0);
                 hose.segments = segments_for(hose);
               }},
    HiddenKind{
        "hose-inertance-excess", "drive",
        [](Draw& draw) { draw.plant.hose.inertia_factor = draw.within("inertance_factor", 1.1, 1.6); }},
    HiddenKind{"hose-loss-excess", "drive",
               [](Draw& draw) { draw.plant.minor_loss_K += draw.within("extra_K", 5.0, 40.0); }},
    HiddenKind{"air-bubble-cavity", "specimen",
               [](Draw& draw) { draw.flaws.cavity.gas_mL = draw.within("volume_mL", 8.0, 40.0); }},
    HiddenKind{"cannula-leak-cavity", "specimen",
               [](Draw& draw) { draw.flaws.cavity.leak_mL_s_kPa = draw.within("leak_mL_s_kPa", 0.05, 0.5); }},
    HiddenKind{"viscoelasticity", "specimen",
               [](Draw& draw) {
                 SpecimenFlaws& gel = draw.flaws.specimen;
                 gel.relaxing = {draw.within("g_fast", 0.02, 0.1), draw.within("g_middle", 0.02, 0.08),
                                 draw.within("g_slow", 0.02, 0.08)};
                 gel.relaxing_s = {draw.within("tau_fast_s", 0.06, 0.2),
                                   draw.within("tau_middle_s", 0.6, 1.6),
                                   draw.within("tau_slow_s", 4.0, 15.0)};
               }},
    HiddenKind{"strain-stiffening", "specimen",
               [](Draw& draw) { draw.flaws.specimen.stiffening = draw.within("beta", 0.6, 2.5); }},
    HiddenKind{"stress-softening", "specimen",
               [](Draw& draw) {
                 SpecimenFlaws& gel = draw.flaws.specimen;
                 gel.softening = draw.within("delta", 0.06, 0.25);
                 gel.softening_cycles = draw.within("cycles", 1.0, 6.0);
                 gel.softening_V0_mL = draw.within("V0_mL", 8.0, 20.0);
               }},
    HiddenKind{"temperature-drift", "specimen",
               [](Draw& draw) {
                 draw.flaws.specimen.warming = draw.either_sign("fraction", 0.02, 0.08);
                 draw.flaws.specimen.warming_s = draw.within("tau_s", 20.0, 100.0);
               }},
    HiddenKind{"end-bond-slip", "specimen",
               [](Draw& draw) { draw.flaws.specimen.bond_left = 1 - draw.within("bond_lost", 0.3, 0.8); }},
    HiddenKind{
        "radius-error", "specimen",
        [](Draw& draw) { draw.flaws.specimen.inner_radius_part = draw.either_sign("fraction", 0.02, 0.08); }},
    HiddenKind{"chamber-back-pressure", "specimen",
               [](Draw& draw) {
                 draw.flaws.specimen.chamber_kPa_mL = kPa_per_Pa * draw.within("k_Pa_mL", 8.0, 50.0);
               }},
    HiddenKind{"sensor-gain", "sensor",
               [](Draw& draw) { draw.flaws.sensors.gain = draw.either_sign("gain", 0.04, 0.15); }},
    HiddenKind{"sensor-offset", "sensor",
               [](Draw& draw) {
                 draw.flaws.sensors.step_in_cycle = draw.whole("cycle", 3, 6);
                 draw.flaws.sensors.step_kPa = kPa_per_Pa * draw.either_sign("step_Pa", 100.0, 600.0);
               }},
    HiddenKind{"sensor-drift", "sensor",
               [](Draw& draw) {
                 draw.flaws.sensors.drift_kPa_s = kPa_per_Pa * draw.either_sign("rate_Pa_s", 4.0, 20.0);
               }},
    HiddenKind{"catheter-resonance", "sensor",
               [](Draw& draw) {
                 draw.plant.cavity.f0_Hz = draw.within("f0_Hz", 6.0, 20.0);
                 draw.plant.cavity.zeta = draw.within("zeta", 0.15, 0.5);
               }},
    HiddenKind{"trigger-delay", "clock",
               [](Draw& draw) { draw.flaws.sensors.delay_s = draw.within("delay_s", 0.008, 0.05); }},
    // Readings fall behind, as by a clock that counts too many seconds: ppm of `diastole explain` is negative.
    HiddenKind{"clock-skew", "clock",
               [](Draw& draw) {
                 draw.flaws.sensors.lag_ppm = draw.within("ppm", 400.0, 2000.0);
                 draw.drawn["ppm"] = -draw.flaws.sensors.lag_ppm;
               }},
    HiddenKind{"outside:sticking-seal", "drive",
               [](Draw& draw) {
                 draw.flaws.drive.stick_mL = draw.within("stick_mL", 0.5, 1.5);
                 draw.flaws.drive.stick_share = 0.4;
               }},
    HiddenKind{"outside:kinking-hose", "drive",
               [](Draw& draw) {
                 draw.flaws.cavity.kink_K = draw.within("extra_K", 60.0, 200.0);
                 draw.flaws.cavity.kink_above_mL = draw.within("above_mL", 12.0, 20.0);
               }},
    HiddenKind{"outside:mains-hum", "sensor",
               [](Draw& draw) {
                 draw.flaws.sensors.hum_Hz = draw.within("hum_Hz", 3.0, 20.0);
                 draw.flaws.sensors.hum_kPa = draw.within("hum_kPa", 0.05, 0.3);
               }},
};

const HiddenKind& kind_named(const std::string& id) {
  const auto* found = std::ranges::find(known_effects, id, &HiddenKind::id);
  if (found != known_effects.end()) return *found;
  std::vector<std::string> known{"none", "outside", "any"};
  for (const HiddenKind& kind : known_effects)
    known.emplace_back(kind.id);
  throw InputError(
      {"", "option --hide", fmt::format("\"{}\" is no effect that can be hidden", id),
       did_you_mean(id, known) + "`sim_rig hidden` lists all; a file of your own ends in .effect.toml."});
}

/// A seed's first choice, apart from the sizes.
std::vector<const HiddenKind*> chosen(const std::vector<std::string>& ids, std::mt19937_64& random) {
  std::vector<const HiddenKind*> known, outside, result;
  for (const HiddenKind& kind : known_effects)
    (kind.is_outside() ? outside : known).push_back(&kind);
  const auto one_of = [&](const auto& list) { return list[random() % list.size()]; };
  for (const std::string& id : ids) {
    if (id == "none" || is_effect_file(id)) continue;
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

std::span<const HiddenKind> hidden_kinds() { return known_effects; }

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
  for (const std::string& id : ids) {
    if (!is_effect_file(id)) continue;
    Draw draw(plant, random());
    const HiddenFile file = hide_file(id, draw);
    json["truth"].push_back({{"id", file.id}, {"port", file.port}, {"parameters", draw.drawn}});
    json["kind"] = json["truth"].size() == 1 ? "single" : put.empty() ? "pair" : json["kind"];
  }
  return json_text(json, 1) + "\n";
}

std::string list_of_hidden() {
  std::string text;
  for (const HiddenKind& kind : known_effects)
    text += fmt::format("{:24} {}\n", kind.id, kind.port);
  return text +
         "none, outside (one of no library), any (nothing, one, two or one of no library), or a file "
         "NAME.effect.toml\n";
}

}  // namespace diastole::sim_rig
