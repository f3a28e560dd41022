// The main job without hardware, whole programs only: an experiment becomes a sound run file that other
// people's software reads, with every trigger, step and sample accounted for.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>
#include <sstream>
#include <vector>

#include "tests/flow/programs.hpp"

namespace diastole::flow {
namespace {

using nlohmann::json;

constexpr double microstep_mL = 0.00779165;

struct PinCounts {
  int64_t inflating_steps = 0;
  int64_t deflating_steps = 0;
  int64_t ttl = 0;
  int64_t r_waves = 0;
  int64_t highest_r_wave_uV = 0;
};

struct PinRow {
  int64_t time_ns = 0;
  std::string signal;
  int64_t value = 0;
};

std::vector<PinRow> read_pins(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  EXPECT_EQ(line, "time_ns,signal,value");
  std::vector<PinRow> rows;
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    PinRow& row = rows.emplace_back();
    std::istringstream(line) >> row.time_ns >> row.signal >> row.value;
  }
  EXPECT_TRUE(std::is_sorted(rows.begin(), rows.end(),
                             [](const PinRow& a, const PinRow& b) { return a.time_ns < b.time_ns; }));
  return rows;
}

/// Steps count from the first trigger on: before it lies homing. Every trigger must rise together with a
/// step, but for `without_step` of them.
PinCounts count_pins(const std::filesystem::path& path, int64_t without_step = 0) {
  const std::vector<PinRow> rows = read_pins(path);
  std::set<int64_t> trigger_ns, step_ns;
  for (const PinRow& row : rows) {
    if (row.value == 0) continue;
    if (row.signal == "TTL") trigger_ns.insert(row.time_ns);
    if (row.signal == "STEP") step_ns.insert(row.time_ns);
  }
  EXPECT_EQ(std::ranges::count_if(trigger_ns, [&](int64_t t) { return !step_ns.contains(t); }), without_step);
  PinCounts counts;
  counts.ttl = std::ssize(trigger_ns);
  bool inflate = false;
  int64_t r_wave_uV = 0;
  for (const PinRow& row : rows) {
    if (row.signal == "DIR") inflate = row.value == 1;
    if (row.signal == "STEP" && row.value == 1 && row.time_ns >= *trigger_ns.begin()) {
      ++(inflate ? counts.inflating_steps : counts.deflating_steps);
    }
    if (row.signal == "RWAVE_uV") {
      if (r_wave_uV == 0 && row.value > 0) ++counts.r_waves;
      counts.highest_r_wave_uV = std::max(counts.highest_r_wave_uV, row.value);
      r_wave_uV = row.value;
    }
  }
  return counts;
}

/// The run as h5py alone reads it; null where Python or h5py is not installed.
json read_with_h5py(const Workplace& place, const std::string& run_file) {
  const Ended read = run(
      place, {"/usr/bin/python3", std::string(DIASTOLE_SOURCE_DIR) + "/tests/flow/read_run.py", run_file});
  EXPECT_EQ(read.exit_code, 0) << read.err;
  return read.exit_code == 0 ? read.json() : json();
}

TEST(SimulatedSession, TheGelSessionIsWholeSoundAndReadableByOthers) {
  const Workplace place;
  place.write("gel.experiment.toml", source_text("examples/gel.experiment.toml"));
  const Ended simulated = run(place, {"diastole", "simulate", "gel.experiment.toml", "-o", "gel.run.h5",
                                      "--pins", "pins.csv", "--json"});
  ASSERT_EQ(simulated.exit_code, 0) << simulated.err;
  const json session = simulated.json();
  EXPECT_EQ(session["run"], "gel.run.h5");
  EXPECT_EQ(session["cycles"], 10);
  EXPECT_EQ(session["triggers"], 10);
  EXPECT_EQ(session["gaps"], 0);
  EXPECT_EQ(session["samples"].get<int64_t>() + session["gaps"].get<int64_t>(), session["expected"]);
  // 1 s of rest and ten cycles of 1.2 s; a little more is recorded after the last step.
  EXPECT_GE(session["samples"], 13 * 300);
  EXPECT_LE(session["samples"], 14 * 300);
  EXPECT_GE(session["simulated_seconds"], 13.0);
  EXPECT_GT(session["wall_seconds"], 0.0);
  EXPECT_TRUE(std::filesystem::is_empty(place.temporary())) << "temporary files are left";

  const Ended inspected = run(place, {"diastole", "inspect", "gel.run.h5", "--json"});
  EXPECT_EQ(inspected.exit_code, 0) << inspected.err;
  EXPECT_EQ(inspected.json()["sound"], true);

  const Ended binned = run(place, {"diastole", "bin", "gel.run.h5", "--frames", "16", "--json"});
  ASSERT_EQ(binned.exit_code, 0) << binned.err;
  const json frames = binned.json()["frames"];
  ASSERT_EQ(frames.size(), 16U);
  double peak_kPa = 0;
  for (const json& frame : frames) {
    EXPECT_EQ(frame["cycles"], 10);
    EXPECT_LT(frame["sd_kPa"], 0.1);
    peak_kPa = std::max(peak_kPa, frame["mean_kPa"].get<double>());
  }
  EXPECT_GT(peak_kPa, 4.0);  // 40 mL in a gel of 8.8 kPa
  EXPECT_LT(peak_kPa, 5.5);
  EXPECT_LT(frames[0]["mean_kPa"], 0.3);

  const PinCounts pins = count_pins(place / "pins.csv");
  const auto steps_per_stroke = std::lround(40 / microstep_mL);
  EXPECT_EQ(pins.inflating_steps, 10 * steps_per_stroke);
  EXPECT_EQ(pins.deflating_steps, 10 * steps_per_stroke);
  EXPECT_EQ(pins.ttl, 10);
  EXPECT_EQ(pins.r_waves, 10);
  EXPECT_NEAR(static_cast<double>(pins.highest_r_wave_uV), 20'000, 200);

  const json seen = read_with_h5py(place, "gel.run.h5");
  ASSERT_FALSE(seen.is_null());
  EXPECT_EQ(seen["samples"], session["samples"]);
  EXPECT_EQ(seen["triggers_s"].size(), 10U);
  EXPECT_EQ(seen["missing"], 0);
  EXPECT_NEAR(seen["rate_Hz"], 300, 0.01);
  EXPECT_NEAR(seen["peak_commanded_mL"], static_cast<double>(steps_per_stroke) * microstep_mL, 0.001);
  EXPECT_LE(seen["pump_interval_s"], 1.0 / 300 + 1e-6);
  for (size_t i = 1; i < 10; ++i) {
    EXPECT_NEAR(seen["triggers_s"][i].get<double>() - seen["triggers_s"][i - 1].get<double>(), 1.2, 1e-6);
  }
}

TEST(SimulatedSession, AnUploadedWaveformIsFollowedAndKept) {
  const Workplace place;
  place.write("heart.experiment.toml",
              with(source_text("examples/heart.experiment.toml"), "cycles = 8", "cycles = 2"));
  place.write("heart.csv", source_text("examples/heart.csv"));
  const Ended simulated = run(place, {"diastole", "simulate", "heart.experiment.toml", "-o", "heart.run.h5",
                                      "--pins", "pins.csv", "--json"});
  ASSERT_EQ(simulated.exit_code, 0) << simulated.err;
  EXPECT_EQ(simulated.json()["triggers"], 2);
  const PinCounts pins = count_pins(place / "pins.csv");
  EXPECT_EQ(pins.inflating_steps, 2 * std::lround(16 / microstep_mL));
  EXPECT_EQ(pins.deflating_steps, pins.inflating_steps);
  const Ended inspected = run(place, {"diastole", "inspect", "heart.run.h5", "--json"});
  EXPECT_EQ(inspected.json()["sound"], true) << inspected.out;

  const json seen = read_with_h5py(place, "heart.run.h5");
  ASSERT_FALSE(seen.is_null());
  const json waveform = seen["waveforms"]["0"];
  EXPECT_EQ(waveform["points"], source_text("examples/heart.csv"));
  ASSERT_EQ(waveform["phase"].size(), 49U);
  ASSERT_EQ(waveform["fraction"].size(), 49U);
  // The commanded volume is the waveform's at its points, to half a microstep.
  const double start_s = seen["segment_start_s"][0];
  for (size_t i = 0; i < seen["pump_time_s"].size(); ++i) {
    const double point = (seen["pump_time_s"][i].get<double>() - start_s) / 1.5 * 48;
    if (point < 0 || point > 96 || std::abs(point - std::round(point)) > 0.01) continue;
    const double fraction = waveform["fraction"][static_cast<size_t>(std::lround(point)) % 48];
    EXPECT_NEAR(seen["commanded_mL"][i].get<double>(), 16 * fraction, microstep_mL) << point;
  }
}

TEST(SimulatedSession, TheSameSeedGivesTheSameRun) {
  const Workplace place;
  const std::string experiment = place.write(
      "gel.experiment.toml", with(source_text("examples/gel.experiment.toml"), "cycles = 10", "cycles = 2"));
  const auto data_of = [&](const std::string& name, const std::string& seed) {
    const Ended simulated = run(place, {"diastole", "simulate", experiment, "-o", name + ".run.h5", "--pins",
                                        name + ".csv", "--seed", seed});
    EXPECT_EQ(simulated.exit_code, 0) << simulated.err;
    std::string data;
    for (const char* dataset : {"/pressure", "/pump", "/trigger", "/gaps", "/events", "/clock"}) {
      data += run(place, {"/usr/bin/h5dump", "-m", "%.17g", "-g", dataset, name + ".run.h5"}).out;
    }
    data.erase(0, data.find('\n'));  // names the file
    while (data.find(name + ".run.h5") != std::string::npos) {
      data.erase(data.find(name + ".run.h5"), name.size() + 7);
    }
    std::ifstream pins(place / (name + ".csv"));
    return std::make_pair(data, std::string(std::istreambuf_iterator<char>(pins), {}));
  };
  const auto first = data_of("first", "5");
  const auto again = data_of("again", "5");
  const auto other = data_of("other", "6");
  EXPECT_GT(first.first.size(), 1000U);
  EXPECT_EQ(first.first, again.first);
  EXPECT_EQ(first.second, again.second);
  EXPECT_NE(first.first, other.first);
  EXPECT_EQ(first.second, other.second) << "the noise's seed must not reach the controller's pins";
}

TEST(SimulatedSession, SegmentsOffsetsAndGatingAreCarriedOut) {
  const Workplace place;
  place.write("two.experiment.toml", R"(format = "diastole-experiment"
version = 1
sample_rate_Hz = 300
gate_every = 2
rest_s = 0.5
[[segment]]
waveform = "sinusoidal"
stroke_mL = 10.0
period_s = 1.0
cycles = 4
[[segment]]
waveform = "parabolic"
stroke_mL = 20.0
period_s = 1.2
cycles = 2
offset_mL = 10.0
)");
  place.write("soft.rig.toml", source_text("examples/rig.toml") + "\n[simulation]\nC1_kPa = 4.4\n");
  const Ended simulated = run(place, {"diastole", "simulate", "two.experiment.toml", "-o", "two.run.h5",
                                      "--pins", "pins.csv", "--config", "soft.rig.toml", "--json"});
  ASSERT_EQ(simulated.exit_code, 0) << simulated.err;
  EXPECT_EQ(simulated.json()["triggers"], 6);
  const PinCounts pins = count_pins(place / "pins.csv");
  EXPECT_EQ(pins.ttl, 6);
  EXPECT_EQ(pins.r_waves, 3);
  const json seen = read_with_h5py(place, "two.run.h5");
  ASSERT_FALSE(seen.is_null());
  EXPECT_NEAR(seen["peak_commanded_mL"], 30, 0.01);
  EXPECT_GT(seen["peak_kPa"], 1.4);  // half the built-in gel's stiffness
  EXPECT_LT(seen["peak_kPa"], 2.4);
}

TEST(SimulatedSession, EveryWaveformIsCarriedOut) {
  const Workplace place;
  place.write("all.experiment.toml", R"(format = "diastole-experiment"
version = 1
rest_s = 0.2
[[segment]]
waveform = "hold"
period_s = 0.5
[[segment]]
waveform = "trapezoidal"
stroke_mL = 8.0
period_s = 0.8
cycles = 2
[[segment]]
waveform = "sawtooth"
stroke_mL = 8.0
period_s = 0.8
cycles = 2
[[segment]]
waveform = "reversed-sawtooth"
stroke_mL = 8.0
period_s = 0.8
cycles = 2
[[segment]]
waveform = "hold"
stroke_mL = 12.0
period_s = 1.0
cycles = 2
)");
  const Ended simulated = run(place, {"diastole", "simulate", "all.experiment.toml", "-o", "all.run.h5",
                                      "--pins", "pins.csv", "--json"});
  ASSERT_EQ(simulated.exit_code, 0) << simulated.err;
  EXPECT_EQ(simulated.json()["cycles"], 9);
  EXPECT_EQ(simulated.json()["triggers"], 9);
  EXPECT_EQ(count_pins(place / "pins.csv", 3).ttl, 9);
  const json seen = read_with_h5py(place, "all.run.h5");
  ASSERT_FALSE(seen.is_null());
  EXPECT_NEAR(seen["peak_commanded_mL"], 12, 0.01);
  const Ended inspected = run(place, {"diastole", "inspect", "all.run.h5", "--json"});
  EXPECT_EQ(inspected.exit_code, 0) << inspected.err;
  EXPECT_EQ(inspected.json()["sound"], true);
}

TEST(SimulatedSession, AnUnreachableAccelerationIsRefusedWithItsRemedy) {
  const Workplace place;
  place.write("quick.experiment.toml",
              with(source_text("examples/gel.experiment.toml"), "\"parabolic\"", "\"sawtooth\""));
  const Ended refused = run(place, {"diastole", "simulate", "quick.experiment.toml", "-o", "quick.run.h5"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, testing::HasSubstr("limit acceleration"));
  EXPECT_THAT(refused.err, testing::HasSubstr("a parabolic waveform needs least"));
}

TEST(SimulatedSession, InRealTimeEverySampleIsReceivedOrDeclaredMissing) {
  const Workplace place;
  const std::string experiment =
      place.write("short.experiment.toml",
                  with(source_text("examples/gel.experiment.toml"), "cycles = 10", "cycles = 2"));
  place.write("patient.rig.toml", with_longest_lease(source_text("examples/rig.toml")));
  const Ended simulated = run(place, {"diastole", "simulate", experiment, "-o", "short.run.h5", "--real-time",
                                      "--config", "patient.rig.toml", "--json"});
  ASSERT_THAT(simulated.exit_code, testing::AnyOf(0, 1)) << simulated.err;
  const json session = simulated.json();
  EXPECT_EQ(session["triggers"], 2);
  EXPECT_EQ(session["samples"].get<int64_t>() + session["gaps"].get<int64_t>(), session["expected"]);
  EXPECT_EQ(simulated.exit_code, session["gaps"] == 0 ? 0 : 1);
  const Ended inspected = run(place, {"diastole", "inspect", "short.run.h5"});
  EXPECT_EQ(inspected.exit_code, simulated.exit_code) << inspected.out;
  const json seen = read_with_h5py(place, "short.run.h5");
  ASSERT_FALSE(seen.is_null());
  EXPECT_EQ(seen["missing"], session["gaps"]);
}

}  // namespace
}  // namespace diastole::flow
