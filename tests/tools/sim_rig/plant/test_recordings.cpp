// The plant against recordings that an independent program made of the same base rig, with no hidden effect:
// fed with the recorded piston volume it must give the recorded cavity pressure, within the noise and the
// cycle-to-cycle variation that the recording program added (10 Pa, and some 0.3 % of the pressure).

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "protocol/runfile/reader.hpp"
#include "tests/recorded_data.hpp"
#include "tools/sim_rig/plant/plant.hpp"

namespace diastole::sim_rig {
namespace {

namespace fs = std::filesystem;

const fs::path recordings = test::recorded("rig");

/// Gives the plant a volume trace as edges every half millisecond, the line between two points in small
/// stairs.
void displace_between(Plant& plant, const runfile::PumpTrace& pump, size_t i) {
  constexpr int stairs = 7;
  const double interval_s = pump.time_s[i + 1] - pump.time_s[i];
  const double change_mL = pump.commanded_mL[i + 1] - pump.commanded_mL[i];
  for (int j = 0; j < stairs; ++j) {
    plant.displace(pump.time_s[i] + interval_s * j / stairs,
                   pump.commanded_mL[i] + change_mL * (j + 0.5) / stairs);
  }
}

double rms_difference_kPa(const runfile::RecordedRun& run, double C1_kPa, double offset_kPa) {
  PlantConfig config;
  config.C1_kPa = C1_kPa;
  config.piston_lag_ms = 0.05;
  config.cavity.bits = 0;
  config.cavity.offset_kPa = offset_kPa;
  Plant plant(config);
  const auto& pressure = run.pressure;
  const auto& cavity_kPa = pressure.channels.at("cavity_kPa");
  double sum = 0;
  size_t given = 0;
  for (size_t k = 0; k < pressure.time_s.size(); ++k) {
    for (; given + 1 < run.pump.time_s.size() && run.pump.time_s[given] <= pressure.time_s[k]; ++given) {
      displace_between(plant, run.pump, given);
    }
    plant.advance_to(pressure.time_s[k]);
    sum += std::pow(plant.cavity_reading_kPa() - cavity_kPa[k], 2);
  }
  return std::sqrt(sum / static_cast<double>(pressure.time_s.size()));
}

constexpr double bound_kPa = 0.025;

TEST(PlantAgainstTheExample, CavityPressureIsTheRecorded) {
  const auto run = runfile::read_run(fs::path(DIASTOLE_SOURCE_DIR) / "examples/recorded-no-effect.run.h5");
  constexpr double C1_kPa = 5.87946;  // of the recording program
  constexpr double offset_kPa = -0.00716721;
  EXPECT_LT(rms_difference_kPa(run, C1_kPa, offset_kPa), bound_kPa);
  EXPECT_GT(rms_difference_kPa(run, 1.05 * C1_kPa, offset_kPa), bound_kPa) << "the bound must see 5 %";
}

class PlantAgainstRecording : public testing::TestWithParam<const char*> {};

TEST_P(PlantAgainstRecording, CavityPressureIsTheRecorded) {
  std::ifstream labels_file(recordings / "labels.json");
  const auto label = nlohmann::json::parse(labels_file).at(GetParam());
  ASSERT_EQ(label.at("kind"), "none");
  for (const char* name : {"baseline", "sweep"}) {
    const auto run = runfile::read_run(recordings / GetParam() / (std::string(name) + ".run.h5"));
    const double rms_kPa =
        rms_difference_kPa(run, label.at("C1_kPa"), label.at("offset_Pa").get<double>() / 1000);
    EXPECT_LT(rms_kPa, bound_kPa) << name;
  }
}

INSTANTIATE_TEST_SUITE_P(WithoutEffect, PlantAgainstRecording, testing::Values("case-009", "case-028"));

}  // namespace
}  // namespace diastole::sim_rig
