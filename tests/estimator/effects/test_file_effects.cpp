// Effects of files: those of examples/effects that express a built-in one give its pressures, and what a file may not say is
// refused with its place.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "estimator/effects/effect_library.hpp"
#include "estimator/effects/file_effect.hpp"
#include "estimator/model/study_effects.hpp"
#include "estimator/rig/simulation.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;

/// A curve that bends; no neighbours.
class BentCurve final : public rig::SpecimenCurves {
 public:
  BentCurve() {
    std::vector<rig::SpecimenCurve::Point> points;
    for (double volume = -20.0; volume <= 80.0; volume += 4.0)
      points.push_back({volume, 0.02 * volume - 6e-5 * volume * volume, 0.02 - 1.2e-4 * volume});
    curve_ = rig::SpecimenCurve(points);
  }
  [[nodiscard]] const rig::SpecimenCurve& plain() const override { return curve_; }
  [[nodiscard]] bool has_neighbours() const override { return false; }
  [[nodiscard]] rig::SpecimenCurve neighbour(rig::Difference, double, bool) const override { return curve_; }

 private:
  rig::SpecimenCurve curve_;
};

rig::RunDrive three_strokes() {
  rig::RunDrive run;
  std::vector<rig::Stroke> strokes;
  for (double start_s = 1.0; start_s < 4.0; start_s += 1.2) {
    strokes.push_back({start_s, start_s + 0.6, 0.0, 40.0});
    strokes.push_back({start_s + 0.6, start_s + 1.2, 40.0, 0.0});
    run.place.trigger_s.push_back(start_s);
  }
  run.motion = rig::Motion(strokes, 0.0, 0.05);
  run.place.name = "baseline";
  run.place.started_s = 60.0;
  run.end_s = 5.5;
  return run;
}

rig::Prediction shown(const Effect* effect, const std::vector<double>& values) {
  static const BentCurve family;
  static const rig::RunDrive run = three_strokes();
  rig::RigModel model;
  model.curve = family.plain();
  model.modulus_kPa = 8.0;
  std::vector<ChangePoint> moments;
  if (effect != nullptr && effect->change_points() != ChangePoints::none)
    moments = {{"baseline", 2.3, 62.3}, {"other", 1.0, 1.0}};
  if (effect != nullptr) effect->apply(values, {family, moments}, model);
  std::vector<double> sample_s;
  for (double time_s = 0.0; time_s < run.end_s; time_s += 1.0 / 300.0)
    sample_s.push_back(time_s);
  return rig::observe(model, rig::simulate_plant(model, run), run.place, sample_s);
}

double largest_difference(const rig::Prediction& a, const rig::Prediction& b) {
  double difference = 0.0;
  double size = 0.0;
  for (const auto channel : {&rig::Prediction::cavity_kPa, &rig::Prediction::pump_kPa}) {
    for (size_t k = 0; k < (a.*channel).size(); ++k) {
      difference = std::max(difference, std::abs((a.*channel)[k] - (b.*channel)[k]));
      size = std::max(size, std::abs((a.*channel)[k]));
    }
  }
  return difference / size;
}

std::vector<std::string> ids_of_examples() {
  std::vector<std::string> ids;
  for (const auto& entry : fs::directory_iterator(DIASTOLE_SOURCE_DIR "/examples/effects")) {
    const std::string name = entry.path().filename();
    const std::string id = name.substr(0, name.find(".effect.toml"));
    if (find_effect(id) != nullptr) ids.push_back(id);
  }
  std::ranges::sort(ids);
  return ids;
}

fs::path file_of(const std::string& id) {
  return fs::path(DIASTOLE_SOURCE_DIR "/examples/effects") / (id + ".effect.toml");
}

class BuiltInAsFile : public testing::TestWithParam<std::string> {
 protected:
  const Effect& built_in_ = *find_effect(GetParam());
  std::shared_ptr<const Effect> file_ = read_effect(file_of(GetParam()));
};

TEST_P(BuiltInAsFile, DeclaresTheSame) {
  EXPECT_EQ(file_->text().id, built_in_.text().id);
  EXPECT_EQ(file_->text().port, built_in_.text().port);
  EXPECT_EQ(file_->stage(), built_in_.stage());
  EXPECT_EQ(file_->change_points(), built_in_.change_points());
  EXPECT_EQ(file_->keeps_modulus(), built_in_.keeps_modulus());
  EXPECT_EQ(file_->text().changes, built_in_.text().changes);
  EXPECT_EQ(file_->neutral({}), built_in_.neutral({}));
  ASSERT_EQ(file_->parameters().size(), built_in_.parameters().size());
  for (size_t j = 0; j < file_->parameters().size(); ++j) {
    const EffectParameter& a = file_->parameters()[j];
    const EffectParameter& b = built_in_.parameters()[j];
    EXPECT_EQ(std::tie(a.neutral, a.lower, a.upper, a.typical, a.scale),
              std::tie(b.neutral, b.lower, b.upper, b.typical, b.scale))
        << a.name;
  }
}

TEST_P(BuiltInAsFile, GivesThePressuresOfTheBuiltInOne) {
  std::vector<double> typical, large;
  for (const EffectParameter& parameter : built_in_.parameters()) {
    typical.push_back(parameter.typical);
    large.push_back(0.5 * (parameter.typical + parameter.upper));
  }
  const rig::Prediction base = shown(nullptr, {});
  for (const auto& values : {typical, large}) {
    const rig::Prediction expected = shown(&built_in_, values);
    EXPECT_LE(largest_difference(shown(file_.get(), values), expected), 1e-9);
    EXPECT_GT(largest_difference(base, expected), 1e-5);
  }
}

TEST_P(BuiltInAsFile, IsTheBaseModelExactlyWhereNeutral) {
  const rig::Prediction base = shown(nullptr, {});
  const rig::Prediction same = shown(file_.get(), file_->neutral({}));
  EXPECT_EQ(same.cavity_kPa, base.cavity_kPa);
  EXPECT_EQ(same.pump_kPa, base.pump_kPa);
}

INSTANTIATE_TEST_SUITE_P(Examples, BuiltInAsFile, testing::ValuesIn(ids_of_examples()),
                         [](const auto& example) {
                           std::string name = example.param;
                           std::erase(name, '-');
                           return name;
                         });

TEST(FileEffects, ExpressTwelveBuiltInOnesOrMore) { EXPECT_GE(ids_of_examples().size(), 12U); }

constexpr std::string_view heading = R"toml(format = "diastole-effect"
version = 1
id = "mine"
title = "mine"
port = "%port%"
[[parameter]]
name = "G"
unit = "mL/(s kPa)"
neutral = 0.0
bounds = [0.0, 1.0]
)toml";

std::shared_ptr<const Effect> effect_with(const std::string& port, const std::string& rest) {
  std::string text(heading);
  text.replace(text.find("%port%"), 6, port);
  return make_file_effect(effect_files::read_effect_text(text + rest, "mine.effect.toml"));
}

InputFault fault_of(const std::string& port, const std::string& rest) {
  try {
    effect_with(port, rest);
  } catch (const InputError& error) {
    return error.fault();
  }
  ADD_FAILURE() << rest << " is read";
  return {};
}

TEST(FileEffects, RefuseAPressureAddedToAVolumeWithItsPlace) {
  const InputFault fault = fault_of("specimen", "[equations]\np = \"p + V\"\n");
  EXPECT_EQ(fault.file, "mine.effect.toml");
  EXPECT_EQ(fault.place, "line 12, column 8, key equations.p");
  EXPECT_EQ(fault.problem, "adds kPa and mL");
}

TEST(FileEffects, RefuseWhatNoRigCanDo) {
  for (const auto& [port, rest] :
       {std::pair{"drive", "[equations]\nq_hose = \"2 * q_piston - G * p_pump\"\n"},
        std::pair{"drive", "[equations]\nq_hose = \"q_piston - G * p\"\n"},
        std::pair{"drive", "[equations]\np_seen = \"p\"\n"},
        std::pair{"drive", "[equations]\nc_hose = \"c_hose + t * 1 [m/s^2]\"\n"},
        std::pair{"drive", "[equations]\nx = \"G\"\n"},
        std::pair{"clock", "[equations]\nt_seen = \"t * t / 1 [s]\"\n"},
        std::pair{"sensor", "[equations]\np_seen = \"p + t_since * 1 [kPa/s]\"\n"},
        std::pair{"specimen", "[equations]\np = \"p\"\nq_cavity = \"q_hose\"\n"},
        std::pair{"specimen",
                  "[[state]]\nname = \"z\"\nunit = \"kPa\"\nrate = \"p\"\n[equations]\np = \"p - z\"\n"},
        std::pair{"specimen",
                  "[[state]]\nname = \"V\"\nunit = \"kPa\"\nrate = \"p\"\n[equations]\np = \"p\"\n"}})
    EXPECT_FALSE(fault_of(port, rest).remedy.empty()) << rest;
}

TEST(FileEffects, RefuseAFormulaThatIsNotFiniteAtRestOrInMotion) {
  for (const auto& [term, with] :
       {std::pair{"1 [s] / t", "t = 0 s"}, std::pair{"log(p / 1 [kPa])", "p = 0 kPa"},
        std::pair{"(p / 1 [kPa])^1e308", "p = 5 kPa"},
        std::pair{"(1 / (1 - G * 1 [s kPa/mL]))", "G = 1 mL/(s kPa)"}}) {
    const InputFault fault =
        fault_of("sensor", "[equations]\np_seen = \"p + G * 1 [s kPa^2/mL] * " + std::string(term) + "\"\n");
    EXPECT_EQ(fault.place, "line 12, column 11, key equations.p_seen") << term;
    EXPECT_NE(fault.problem.find("is not a finite number with"), std::string::npos) << fault.problem;
    EXPECT_NE(fault.problem.find(with), std::string::npos) << fault.problem;
    EXPECT_FALSE(fault.remedy.empty());
  }
  effect_with("sensor", "[equations]\np_seen = \"p + if(t > 0 [s], G * 1 [s^2 kPa^2/mL] / t, 0)\"\n");
}

TEST(FileEffects, RefuseAParameterThatNoFormulaUses) {
  const InputFault fault =
      fault_of("sensor",
               "[[parameter]]\nname = \"H\"\nunit = \"kPa\"\nneutral = 0\nbounds = [0, 1]\n"
               "[equations]\nh = \"2 * t\"\np_seen = \"p + G * 1 [s kPa^2/mL]\"\n");
  EXPECT_EQ(fault.place, "line 12, key parameter[1].name");
  EXPECT_EQ(fault.problem, "no formula uses H");
  // A curve that is nothing is where a term begins to be learnt.
  effect_with("sensor",
              "[[curve]]\nname = \"law\"\nof = \"kPa\"\nunit = \"s kPa^2/mL\"\nat = [-1, 0, 1]\n"
              "values = [0, 0, 0]\n[equations]\np_seen = \"p + G * law(p)\"\n");
}

TEST(FileEffects, ListWhatThePortKnows) {
  const InputFault fault = fault_of("sensor", "[equations]\np_seen = \"p + V_command\"\n");
  EXPECT_NE(fault.problem.find("no quantity \"V_command\""), std::string::npos) << fault.problem;
  EXPECT_EQ(fault.remedy.find("V_command"), std::string::npos) << fault.remedy;
  EXPECT_NE(fault.remedy.find("t_session"), std::string::npos) << fault.remedy;
  EXPECT_NE(fault_of("drive", "[equations]\nV_piston = \"x\"\n").remedy.find("V_command"), std::string::npos);
  EXPECT_EQ(fault_of("sensor", "[equations]\nV_command = \"G\"\n").place, "line 12, key equations.V_command");
}

TEST(FileEffects, RefuseANeutralConstantBeyondTheBounds) {
  const InputFault fault = fault_of("drive",
                                    "[[parameter]]\nname = \"c\"\nunit = \"m/s\"\nneutral = \"c_hose\"\n"
                                    "bounds = [500, 600]\n[equations]\nc_hose = \"c\"\n");
  EXPECT_EQ(fault.place, "line 14, key parameter[1].neutral");
  EXPECT_NE(fault.problem.find("c_hose is 400"), std::string::npos) << fault.problem;
}

TEST(FileEffects, RefuseFormulasOfMoreThanAProgramHolds) {
  std::string definitions, sum, product;
  for (int i = 0; i < 600; ++i) {
    const std::string name = "a" + std::to_string(i);
    definitions += name + " = \"sin(t / " + std::to_string(i + 1) + " [s])\"\n";
    sum += (i > 0 ? " + " : "") + name;
    product += (i > 0 ? " * " : "") + name;
  }
  const InputFault fault =
      fault_of("sensor", "[equations]\n" + definitions + "p_seen = \"p + G * 1 [s kPa^2/mL] * (" + sum +
                             ") * (" + product + ")\"\n");
  EXPECT_EQ(fault.problem, "the formulas are too long");
}

/// What is read and has no slopes that a program could hold.
TEST(FileEffects, RefuseAFormulaOfWhichNothingCanBeMadeWithItsPlace) {
  std::string chain = "[equations]\na0 = \"t / 1 [s]\"\n";
  constexpr int links = 900;
  for (int i = 1; i <= links; ++i)
    chain += fmt::format("a{0} = \"sin(a{1}) * cos(a{1}) + a{1}\"\n", i, i - 1);
  chain += fmt::format("V_piston = \"V_command + G * a{} * 1 [s kPa]\"\n", links);
  const InputFault too_long = fault_of("drive", chain);
  EXPECT_EQ(too_long.place, fmt::format("line {}, column 13, key equations.V_piston", 13 + links));
  EXPECT_EQ(too_long.problem, "the formulas are too long");
  const InputFault without_rest =
      fault_of("drive", "[equations]\nq_hose = \"q_piston - G * log(p_pump / 1 [kPa]) * 1 [kPa]\"\n");
  EXPECT_EQ(without_rest.place, "line 12, column 11, key equations.q_hose");
}

TEST(FileEffects, LoseMoreThroughALeakThatOpens) {
  const auto straight = effect_with("drive", "[equations]\nq_hose = \"q_piston - G * p_pump\"\n");
  const auto bent = effect_with(
      "drive", "[equations]\nq_hose = \"q_piston - G * p_pump * (1 + 1e-9 * p_pump^2 / 1 [kPa^2])\"\n");
  const auto open = effect_with(
      "drive", "[equations]\nq_hose = \"q_piston - G * p_pump * (1 + p_pump^2 / 100 [kPa^2])\"\n");
  const auto valve =
      effect_with("drive", "[equations]\nq_hose = \"q_piston - G * p_pump * abs(p_pump) / 10 [kPa]\"\n");
  const rig::Prediction base = shown(nullptr, {});
  // A leak that hardly bends goes the way of those that do, in steps a fourth as long, and ends where the straight one does: within
  // what its steps are converged to (test_simulation.cpp).
  constexpr double converged_kPa = 5e-4;
  EXPECT_LE(largest_difference(shown(bent.get(), {0.05}), shown(straight.get(), {0.05})), converged_kPa);
  EXPECT_GT(largest_difference(shown(open.get(), {0.05}), base),
            1.1 * largest_difference(shown(straight.get(), {0.05}), base));
  const rig::Prediction of_valve = shown(valve.get(), {0.05});
  EXPECT_TRUE(std::ranges::all_of(of_valve.cavity_kPa, [](double p) { return std::isfinite(p); }));
  EXPECT_GT(largest_difference(of_valve, base), 1e-3);
}

/// Nothing is lost up to 15 kPa, nor by the second before the first moment.
TEST(FileEffects, KeepALeakThatIsNothingWhileItIsClosed) {
  const BentCurve family;
  rig::RunPlace place;
  for (const std::string lost : {"G * max(p_pump - 15 [kPa], 0 [kPa])", "G * min(p_pump + 15 [kPa], 0 [kPa])",
                                 "G * p_pump * min(max(t - 0.5 [s], 0 [s]) / 1 [s], 1)"}) {
    const auto effect = effect_with("drive", "[equations]\nq_hose = \"q_piston - " + lost + "\"\n");
    rig::RigModel model;
    effect->apply(std::vector{0.05}, {family, {}}, model);
    ASSERT_EQ(model.pump_leaks.size(), 1U) << lost;
    EXPECT_EQ(model.pump_leak_mL_s_kPa, 0.0) << lost;
    const double open_kPa = lost.find("min(p_pump") != std::string::npos ? -25.0 : 25.0;
    EXPECT_GE(std::abs(model.pump_leaks.front()(place)(open_kPa, 2.0)), 0.05 * 10.0 - 1e-12) << lost;
    rig::RigModel neutral;
    effect->apply(std::vector{0.0}, {family, {}}, neutral);
    EXPECT_TRUE(neutral.pump_leaks.empty()) << lost;
  }
  const auto relief =
      effect_with("drive", "[equations]\nq_hose = \"q_piston - G * max(p_pump - 15 [kPa], 0 [kPa])\"\n");
  const rig::Prediction base = shown(nullptr, {});
  ASSERT_GT(std::ranges::max(base.pump_kPa), 16.0);
  EXPECT_GT(largest_difference(shown(relief.get(), {0.2}), base), 1e-3);
}

/// A dead band on both sides: at no pressure more is lost than past a seal that is open.
TEST(FileEffects, LoseNoMoreThroughALeakThatOpensThanThroughAnOpenOne) {
  const auto open = effect_with("drive", "[equations]\nq_hose = \"q_piston - G * p_pump\"\n");
  const auto opens = effect_with(
      "drive",
      "[equations]\nq_hose = \"q_piston - G * (max(p_pump - 5 [kPa], 0) + min(p_pump + 5 [kPa], 0))\"\n");
  const rig::Prediction base = shown(nullptr, {});
  for (const double G : {0.002, 0.05})
    EXPECT_LT(largest_difference(shown(opens.get(), {G}), base),
              largest_difference(shown(open.get(), {G}), base))
        << G;
}

TEST(FileEffects, LeakAtThePhasesTheySay) {
  const auto late = effect_with(
      "drive", "[equations]\nq_hose = \"q_piston - G * p_pump * if(phase > 0.8, phase - 0.8, 0)\"\n");
  EXPECT_GT(largest_difference(shown(late.get(), {0.05}), shown(nullptr, {})), 1e-3);
  EXPECT_EQ(shown(late.get(), {0.0}).pump_kPa, shown(nullptr, {}).pump_kPa);
}

/// A conductance that would be negative is none of the line's.
TEST(FileEffects, StepByNoNegativeConductance) {
  const BentCurve family;
  const auto source = effect_with("drive", "[equations]\nq_hose = \"q_piston + G * p_pump\"\n");
  rig::RigModel model;
  source->apply(std::vector{0.05}, {family, {}}, model);
  EXPECT_EQ(model.pump_leak_mL_s_kPa, 0.0);
  EXPECT_EQ(model.pump_leaks.size(), 1U);
}

TEST(FileEffects, IntegrateStatesOfADriveAndASensor) {
  // A sensor of first order: what lags by tau, within the step, is what came tau before.
  const auto lag = effect_with("sensor", R"toml([[state]]
name = "z"
unit = "kPa"
initial = "p"
rate = "(p - z) / (0.01 [s] + G * 1 [s^2 kPa/mL])"
[equations]
p_seen = "z"
)toml");
  const rig::Prediction base = shown(nullptr, {});
  const rig::Prediction late = shown(lag.get(), {0.0});
  double difference = 0.0;
  for (size_t k = 3; k < base.cavity_kPa.size(); ++k)
    difference = std::max(difference, std::abs(late.cavity_kPa[k] - base.cavity_kPa[k - 3]));
  EXPECT_LT(difference, 0.02 * *std::ranges::max_element(base.cavity_kPa));
}

TEST(EffectLibrary, PutsAFilesEffectInPlaceOfTheBuiltInOneOfItsId) {
  EffectLibrary library;
  const size_t count = library.all().size();
  const auto own = read_effect(file_of("seal-leak-pump"));
  library.add(own);
  EXPECT_EQ(library.all().size(), count);
  EXPECT_EQ(library.find("seal-leak-pump"), own.get());
  library.add(read_effect(file_of("my-seal")));
  EXPECT_EQ(library.all().size(), count + 1);
  EXPECT_EQ(find_effect("my-seal"), nullptr);
}

TEST(StudyEffects, KnowAFileByWhateverPathNamesIt) {
  const test::ScratchFolder folder;
  const fs::path file = folder.path() / "mine.effect.toml";
  fs::copy(file_of("my-seal"), file);
  fs::create_symlink(file, folder.path() / "link.effect.toml");
  Study study;
  study.file = folder.path() / "a.study.toml";
  study.effect_files = {file, folder.path() / "." / "mine.effect.toml", folder.path() / "link.effect.toml"};
  EXPECT_NE(effects_known_to(study).find("my-seal"), nullptr);
  fs::copy(file, folder.path() / "copy.effect.toml");
  study.effect_files.push_back(folder.path() / "copy.effect.toml");
  EXPECT_THROW(effects_known_to(study), InputError);
}

/// What a page of constants says is what the model has.
TEST(FileEffects, SeeTheConstantsOfTheModel) {
  for (size_t i = effect_files::index_of(effect_files::first_constant); i < effect_files::quantity_count;
       ++i) {
    const auto& quantity = effect_files::quantities[i];
    const std::string port(effect_files::port_of(static_cast<effect_files::In>(i)));
    const auto effect = make_file_effect(effect_files::read_effect_text(
        "format = \"diastole-effect\"\nversion = 1\nid = \"c\"\ntitle = \"c\"\nport = \"" + port +
            "\"\n[[parameter]]\nname = \"x\"\nunit = \"" + std::string(quantity.unit) + "\"\nneutral = \"" +
            std::string(quantity.name) + "\"\nbounds = [-1e6, 1e6]\n[equations]\n" +
            std::string(quantity.name) + " = \"x\"\n",
        "c.effect.toml"));
    EXPECT_EQ(effect->neutral({}).front(), quantity.usual) << quantity.name;
  }
}

}  // namespace
}  // namespace diastole
