// `diastole lv`: guide points to a mesh that a study solves, tables, a page and JSON; bad input leaves nothing.

#include <gmock/gmock.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "estimator/io/whole_file.hpp"
#include "tests/estimator/cli/run_command.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tools/sim_scanner/ventricle_phantom.hpp"

namespace diastole {
namespace {

using scanner::VentriclePhantom;
using testing::AllOf;
using testing::HasSubstr;

std::string guide_of(const VentriclePhantom& ventricle) {
  return scanner::click(ventricle, {.phases = 3}).guide_csv;
}

TEST(LvCommand, MakesAMeshThatAStudySolves) {
  const test::ScratchFolder folder;
  const VentriclePhantom ventricle = VentriclePhantom::random(5);
  const std::string guide = folder.write("ventricle.guide.csv", guide_of(ventricle)).string();
  const auto in_folder = [&](const char* name) { return (folder.path() / name).string(); };
  const nlohmann::json reported = nlohmann::json::parse(
      test::run_command({"lv", guide, "-o", in_folder("ventricle.mesh"), "--mesh", "6,3,1", "--fibre-deg",
                         "60,-60", "--volumes", in_folder("volumes.csv"), "--surface",
                         in_folder("surface.csv"), "--page", in_folder("ventricle.html"), "--json"})
          .output);
  EXPECT_EQ(reported["elements"], 18);
  EXPECT_EQ(reported["node_sigma_mm"].size(), 48U);
  EXPECT_EQ(reported["phases"].size(), 3U);
  EXPECT_EQ(reported["largest_phase"], 0);
  EXPECT_GT(reported["least_jacobian"].get<double>(), 0.5);
  const double cavity_mL = reported["cavity_mL"].get<double>();
  EXPECT_NEAR(cavity_mL, ventricle.cavity_mL(0), 0.03 * ventricle.cavity_mL(0));
  for (const auto& shift : reported["slice_shifts_mm"])
    EXPECT_EQ(shift["reference"].get<bool>(), shift["slice"].get<std::string>().starts_with("la"));
  EXPECT_THAT(read_whole_file(in_folder("volumes.csv")), testing::StartsWith("phase,cavity_volume_mL,"));
  EXPECT_THAT(read_whole_file(in_folder("surface.csv")),
              AllOf(testing::StartsWith("phase,surface,x_mm,y_mm,z_mm\n"), HasSubstr("\n2,epi,")));
  EXPECT_THAT(read_whole_file(in_folder("ventricle.html")),
              AllOf(HasSubstr("Over the cycle"), HasSubstr("Slice la0")));

  const std::string study = folder
                                .write("ventricle.study.toml",
                                       "format = \"diastole-study\"\nversion = 1\n[specimen]\nkind = "
                                       "\"fitted-lv\"\nmesh_file = \"ventricle.mesh\"\n"
                                       "ends = \"fixed\"\n[law]\nname = \"guccione\"\n"
                                       "[law.parameters.C_kPa]\nstart = 2.0\nbounds = [1.0, 15.0]\n"
                                       "[law.parameters.b1]\nstart = 8.0\nbounds = [1.0, 15.0]\n"
                                       "[law.parameters.b2]\nstart = 2.0\nbounds = [1.0, 15.0]\n"
                                       "[law.parameters.b3]\nstart = 4.0\nbounds = [1.0, 15.0]\n[data]\n")
                                .string();
  const auto solved =
      nlohmann::json::parse(test::run_command({"solve", study, "--pressure-kPa", "0.1", "--json"}).output);
  EXPECT_EQ(solved["reason"], "converged");
  // The base lies askew in the patient: the solver closes the cavity by its plane all the same.
  EXPECT_NEAR(solved["cavity_volume_mL"].get<double>() - solved["cavity_volume_change_mL"].get<double>(),
              cavity_mL, 1e-6);
  EXPECT_GT(solved["cavity_volume_change_mL"].get<double>(), 0);
}

TEST(LvCommand, RefusesWithAReasonAndLeavesNothing) {
  const test::ScratchFolder folder;
  const std::string guide = folder.write("ventricle.guide.csv", guide_of({})).string();
  const std::string bad =
      folder.write("bad.guide.csv", "phase,slice,surface,x_mm,y_mm,z_mm,sigma_mm\n0,sa00,endo,1,two,3,0.5\n")
          .string();
  const std::string mesh = (folder.path() / "ventricle.mesh").string();
  const auto refusal = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "lv");
    return test::message_of([&] { (void)test::run_command(arguments); });
  };
  EXPECT_THAT(refusal({bad, "-o", mesh}), AllOf(HasSubstr("bad.guide.csv: line 2, column y_mm"),
                                                HasSubstr("\"two\""), HasSubstr("A row is")));
  EXPECT_THAT(refusal({(folder.path() / "none.csv").string(), "-o", mesh}), HasSubstr("none.csv"));
  EXPECT_THAT(refusal({guide, "-o", guide}), HasSubstr("ventricle.guide.csv"));
  const std::string table = (folder.path() / "ventricle.csv").string();
  EXPECT_THAT(refusal({guide, "-o", table}),
              AllOf(HasSubstr("ventricle.csv"), HasSubstr("is no name of a mesh"), HasSubstr("--volumes")));
  EXPECT_FALSE(std::filesystem::exists(table));
  EXPECT_THAT(refusal({guide, "-o", mesh, "--mesh", "2,2,1"}),
              AllOf(HasSubstr("--mesh"), HasSubstr("2,2,1")));
  EXPECT_THAT(refusal({guide, "-o", mesh, "--phase", "9"}),
              AllOf(HasSubstr("--phase"), HasSubstr("0, 1, 2")));
  EXPECT_FALSE(std::filesystem::exists(mesh));
}

}  // namespace
}  // namespace diastole
