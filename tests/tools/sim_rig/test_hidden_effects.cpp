#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "estimator/effects/effect.hpp"
#include "protocol/contract/input_error.hpp"
#include "tools/sim_rig/hidden_effects.hpp"

namespace diastole::sim_rig {
namespace {

using testing::HasSubstr;

PlantConfig quiet_rig() {
  PlantConfig rig;
  rig.cavity.bits = rig.pump.bits = 0;
  return rig;
}

/// Every 10 ms of eight cycles of 40 mL in 1 s.
struct Session {
  std::vector<double> cavity_reading_kPa, pump_reading_kPa, cavity_kPa, cavity_mL, piston_mL_s;
  std::vector<double>
      off_curve_kPa;  ///< cavity pressure less that of the plain gel at the volume that came in
};

Session session_of(const PlantConfig& config) {
  Plant plant(config);
  const GelAnnulus gel(config.C1_kPa);
  Session session;
  double arrived_mL = 0, flow_mL_s = 0, next_s = 0;
  int cycle = 0;
  for (double t = 0; t < 8.0; t += plant.step_s()) {
    const double counted_mL = 20 * (1 - std::cos(2 * std::numbers::pi * t));
    if (t >= cycle) {
      plant.begin_cycle();
      ++cycle;
    }
    plant.displace(t, counted_mL);
    plant.advance_to(t + 1e-9);
    arrived_mL += 0.5 * plant.step_s() * (flow_mL_s + plant.cavity_flow_mL_s());
    flow_mL_s = plant.cavity_flow_mL_s();
    if (t < next_s) continue;
    next_s += 0.01;
    session.cavity_reading_kPa.push_back(plant.cavity_reading_kPa());
    session.pump_reading_kPa.push_back(plant.pump_reading_kPa());
    session.cavity_kPa.push_back(plant.cavity_kPa());
    session.cavity_mL.push_back(plant.cavity_mL());
    session.piston_mL_s.push_back(plant.pump_flow_mL_s());
    session.off_curve_kPa.push_back(plant.cavity_kPa() - gel.pressure_kPa(arrived_mL));
  }
  return session;
}

double farthest(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

double largest(const std::vector<double>& values) {
  return farthest(values, std::vector<double>(values.size(), 0.0));
}

TEST(HiddenEffects, NoneChangesNothing) {
  PlantConfig rig = quiet_rig();
  EXPECT_THAT(hide({"none"}, 3, rig), HasSubstr("\"kind\": \"none\""));
  const Session plain = session_of(quiet_rig()), hidden = session_of(rig);
  EXPECT_EQ(plain.cavity_reading_kPa, hidden.cavity_reading_kPa);
  EXPECT_EQ(plain.pump_reading_kPa, hidden.pump_reading_kPa);
  EXPECT_LT(largest(plain.off_curve_kPa), 1e-6);
}

TEST(HiddenEffects, EachChangesThePressureByItsPort) {
  const Session plain = session_of(quiet_rig());
  for (const HiddenKind& kind : hidden_kinds()) {
    SCOPED_TRACE(std::string(kind.id));
    PlantConfig rig = quiet_rig();
    hide({std::string(kind.id)}, 11, rig);
    const Session hidden = session_of(rig);
    EXPECT_GT(farthest(plain.cavity_reading_kPa, hidden.cavity_reading_kPa) +
                  farthest(plain.pump_reading_kPa, hidden.pump_reading_kPa),
              0.01);
    if (kind.port == "sensor" || kind.port == "clock") {
      EXPECT_EQ(plain.cavity_kPa, hidden.cavity_kPa);
      EXPECT_EQ(plain.cavity_mL, hidden.cavity_mL);
    } else if (kind.port == "specimen") {
      EXPECT_EQ(plain.piston_mL_s, hidden.piston_mL_s);
      EXPECT_GT(largest(hidden.off_curve_kPa), 0.005);
    } else {
      ASSERT_EQ(kind.port, "drive");
      EXPECT_LT(largest(hidden.off_curve_kPa), 1e-6);
      EXPECT_TRUE(farthest(plain.cavity_mL, hidden.cavity_mL) > 0.05 ||
                  farthest(plain.pump_reading_kPa, hidden.pump_reading_kPa) > 0.1);
    }
  }
}

TEST(HiddenEffects, AreTheOnesThatExplainKnows) {
  std::set<std::string_view> hidden;
  for (const HiddenKind& kind : hidden_kinds()) {
    hidden.insert(kind.id);
    const Effect* effect = find_effect(kind.id);
    if (effect == nullptr) continue;
    EXPECT_EQ(kind.port, name_of(effect->text().port)) << kind.id;
  }
  for (const Effect* effect : all_effects()) {
    if (effect->text().port == Port::field) continue;
    EXPECT_TRUE(hidden.contains(effect->text().id)) << effect->text().id;
  }
}

TEST(HiddenEffects, ASeedDrawsTheSameEverywhereAndAnotherSomethingElse) {
  const auto truth = [](const char* id, uint64_t seed) {
    PlantConfig rig;
    return hide({id}, seed, rig);
  };
  EXPECT_EQ(truth("hose-compliance", 5), truth("hose-compliance", 5));
  EXPECT_NE(truth("hose-compliance", 5), truth("hose-compliance", 6));
  const auto json = nlohmann::json::parse(truth("hose-compliance", 5));
  EXPECT_EQ(json.at("format"), "diastole-sealed");
  const double speed = json.at("truth").at(0).at("parameters").at("wave_speed_m_s");
  EXPECT_GT(speed, 30.0);
  EXPECT_LT(speed, 120.0);
  std::set<std::string> kinds;
  for (uint64_t seed = 0; seed < 60; ++seed)
    kinds.insert(nlohmann::json::parse(truth("any", seed)).at("kind").get<std::string>());
  EXPECT_THAT(kinds, testing::ElementsAre("none", "outside", "pair", "single"));
  EXPECT_EQ(nlohmann::json::parse(truth("outside", 1)).at("kind"), "outside");
}

TEST(HiddenEffects, AnUnknownOneIsRefusedWithTheNearest) {
  PlantConfig rig;
  try {
    hide({"hose-complience"}, 1, rig);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("hose-compliance"));
  }
}

std::string example(const std::string& id) {
  return DIASTOLE_SOURCE_DIR "/examples/effects/" + id + ".effect.toml";
}

/// A built-in effect hidden from its file does what hiding it by its id does at the size that was drawn.
TEST(HiddenFiles, DoWhatTheirEffectsDo) {
  for (const auto& [id, set] :
       {std::pair{"stroke-gain", +[](Flaws&flaws, double size) { flaws.drive.gain = size; }},
        std::pair{"seal-leak-pump", +[](Flaws&flaws, double size) { flaws.pump.leak_mL_s_kPa = size; }},
        std::pair{"cannula-leak-cavity",
                  +[](Flaws&flaws, double size) { flaws.cavity.leak_mL_s_kPa = size; }},
        std::pair{"chamber-back-pressure",
                  +[](Flaws&flaws, double size) { flaws.specimen.chamber_kPa_mL = 1e-3 * size; }},
        std::pair{"air-bubble-pump", +[](Flaws&flaws, double size) { flaws.pump.gas_mL = size; }},
        std::pair{"sensor-gain", +[](Flaws&flaws, double size) { flaws.sensors.gain = size; }}}) {
    PlantConfig by_file = quiet_rig();
    const auto sealed = nlohmann::json::parse(hide({example(id)}, 3, by_file));
    EXPECT_EQ(sealed["kind"], "single");
    EXPECT_EQ(sealed["truth"][0]["id"], id);
    PlantConfig by_id = quiet_rig();
    set(by_id.flaws, sealed["truth"][0]["parameters"].begin().value().get<double>());
    const Session expected = session_of(by_id);
    const double effect_kPa =
        farthest(session_of(quiet_rig()).cavity_reading_kPa, expected.cavity_reading_kPa);
    EXPECT_GT(effect_kPa, 0.005) << id;
    EXPECT_LT(farthest(session_of(by_file).cavity_reading_kPa, expected.cavity_reading_kPa),
              0.01 * effect_kPa)
        << id;
  }
}

TEST(HiddenFiles, AreRefusedWhereThePlantHasNoPort) {
  PlantConfig rig = quiet_rig();
  for (const char* id : {"viscoelasticity", "missed-steps", "trigger-delay"})
    EXPECT_THROW(hide({example(id)}, 1, rig), InputError) << id;
}

}  // namespace
}  // namespace diastole::sim_rig
