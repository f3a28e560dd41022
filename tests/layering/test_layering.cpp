#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "tests/layering/layers.hpp"

namespace diastole::layering {
namespace {

namespace fs = std::filesystem;

TEST(Layering, TheTreeFollowsTheDirectionOfDependence) {
  for (const Include& violation : violations(DIASTOLE_SOURCE_DIR)) {
    ADD_FAILURE() << violation.file << ":" << violation.line << " may not include \"" << violation.included
                  << "\"";
  }
}

TEST(Layering, NoFoldersIncludeEachOtherInACircle) {
  for (const Include& include : circles(DIASTOLE_SOURCE_DIR))
    ADD_FAILURE() << include.file << ":" << include.line << " includes \"" << include.included
                  << "\", from which the way leads back";
}

fs::path planted_root() {
  const fs::path root = fs::path(testing::TempDir()) / ("planted-" + std::to_string(::getpid()));
  fs::remove_all(root);
  return root;
}

void plant(const fs::path& file, const std::string& included) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << "#pragma once\n#include \"" << included << "\"\n";
}

TEST(Layering, ACircleThroughThreeFoldersIsFound) {
  const fs::path root = planted_root();
  plant(root / "estimator/a/a.hpp", "estimator/b/b.hpp");
  plant(root / "estimator/b/b.hpp", "estimator/c/c.hpp");
  plant(root / "estimator/c/c.hpp", "estimator/a/a.hpp");
  plant(root / "estimator/d/d.hpp", "estimator/a/a.hpp");
  const std::vector<Include> found = circles(root);
  fs::remove_all(root);
  EXPECT_EQ(found.size(), 3U);
}

class PlantedViolation : public testing::TestWithParam<std::pair<std::string, std::string>> {};

TEST_P(PlantedViolation, IsFound) {
  const auto& [file, included] = GetParam();
  const fs::path root = planted_root();
  plant(root / file, included);
  const std::vector<Include> found = violations(root);
  fs::remove_all(root);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].file, file);
  EXPECT_EQ(found[0].line, 2);
  EXPECT_EQ(found[0].included, included);
}

INSTANTIATE_TEST_SUITE_P(
    Rules, PlantedViolation,
    testing::Values(std::pair{"host/cli/run.cpp", "estimator/fe/newton.hpp"},
                    std::pair{"estimator/fit/fit.cpp", "host/daq/driver.hpp"},
                    std::pair{"estimator/fit/fit.cpp", "protocol/wire/frame.hpp"},
                    std::pair{"firmware/core/planner.hpp", "firmware/boards/board.hpp"},
                    std::pair{"firmware/core/planner.hpp", "protocol/runfile/run.hpp"},
                    std::pair{"protocol/wire/frame.hpp", "host/daq/driver.hpp"},
                    std::pair{"host/daq/driver.cpp", "tools/sim_daq/server.hpp"},
                    std::pair{"host/journal/journal.cpp", "host/acquisition/acquisition.hpp"},
                    std::pair{"host/controller/refusals.cpp", "host/rig/rig_service.hpp"},
                    std::pair{"host/rpc/server.cpp", "host/web/console.hpp"},
                    std::pair{"host/web/console.cpp", "host/daemon/daemon.hpp"},
                    std::pair{"estimator/fe/newton.cpp", "estimator/io/study.hpp"},
                    std::pair{"estimator/explain/verdict/verdict.cpp", "estimator/explain/rig/search.hpp"},
                    std::pair{"estimator/explain/rig/search.cpp", "estimator/explain/imaging/field_fit.hpp"},
                    std::pair{"tools/sim_rig/plant.cpp", "tests/sim/fake.hpp"},
                    std::pair{"estimator/rig/hose.cpp", "tools/sim_rig/plant.hpp"},
                    std::pair{"tools/sim_rig/plant/gel.cpp", "estimator/fe/newton.hpp"},
                    std::pair{"tools/sim_rig/plant/gel.cpp", "tools/benchmarks/step_rate.hpp"},
                    std::pair{"tools/sim_board/board.cpp", "tools/sim_rig/rig.hpp"},
                    std::pair{"tools/sim_board/core/bus.hpp", "tools/sim_board/peripherals/gpio.hpp"},
                    std::pair{"firmware/core/profiles/hold.cpp", "firmware/core/planner.hpp"},
                    std::pair{"firmware/boards/recording/board.hpp", "firmware/boards/stm32f405/pins.hpp"},
                    std::pair{"host/daq/driver.cpp", "../../estimator/fe/newton.hpp"}));

}  // namespace
}  // namespace diastole::layering
