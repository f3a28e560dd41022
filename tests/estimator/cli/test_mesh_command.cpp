// `diastole mesh`: a study's specimen as a mesh file is the same specimen.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/estimator/cli/run_command.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using testing::HasSubstr;

std::string study_with(const std::string& specimen) {
  return "format = \"diastole-study\"\nversion = 1\n[specimen]\n" + specimen +
         "ends = \"fixed\"\n[law]\nname = \"guccione\"\n"
         "[law.parameters.C_kPa]\nstart = 2.0\nbounds = [1.0, 15.0]\n"
         "[law.parameters.b1]\nstart = 8.0\nbounds = [1.0, 15.0]\n"
         "[law.parameters.b2]\nstart = 2.0\nbounds = [1.0, 15.0]\n"
         "[law.parameters.b3]\nstart = 4.0\nbounds = [1.0, 15.0]\n[data]\n";
}

constexpr const char* heart =
    "kind = \"ellipsoid\"\ninner_axes_mm = [21.0, 51.0]\nouter_axes_mm = [30.0, 60.0]\nbase_z_mm = 15.0\n"
    "fibre_endo_deg = 60.0\nfibre_epi_deg = -60.0\nmesh = [4, 2, 1]\n";

nlohmann::json solved(const std::string& study, const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments{"solve", study, "--pressure-kPa", "0.3", "--json"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return nlohmann::json::parse(test::run_command(arguments).output);
}

TEST(MeshCommand, ExportsAStudysSpecimenAsTheVeryBody) {
  const test::ScratchFolder folder;
  const std::string built_in = folder.write("heart.study.toml", study_with(heart)).string();
  const std::string mesh = (folder.path() / "heart.mesh.toml").string();
  const auto reported =
      nlohmann::json::parse(test::run_command({"mesh", "export", built_in, "-o", mesh, "--json"}).output);
  EXPECT_EQ(reported["elements"], 8);
  EXPECT_EQ(reported["fibres"], true);
  const std::string from_file =
      folder.write("file.study.toml", study_with("kind = \"mesh\"\nfile = \"heart.mesh.toml\"\n")).string();
  const auto expected = solved(built_in);
  const auto found = solved(from_file);
  EXPECT_EQ(found["reason"], "converged");
  EXPECT_NEAR(found["cavity_volume_change_mL"].get<double>(),
              expected["cavity_volume_change_mL"].get<double>(), 1e-9);
  EXPECT_EQ(found["elements"], 8);
  EXPECT_EQ(solved(from_file, {"--refine", "0,0,1"})["elements"], 16);
  EXPECT_THAT(test::message_of([&] { solved(from_file, {"--mesh", "8,4,1"}); }), HasSubstr("--refine"));
  EXPECT_THAT(test::message_of([&] {
                test::run_command({"mesh", "export", built_in, "-o", built_in});
              }),
              HasSubstr("heart.study.toml"));
}

TEST(MeshCommand, TellsWhereAnImportFails) {
  const test::ScratchFolder folder;
  const std::string nodes = folder.write("a.exnode", "Group name: a\nwhat is this\n").string();
  const std::string elements = folder.write("a.exelem", "Group name: a\n").string();
  const std::string mesh = (folder.path() / "a.mesh.toml").string();
  EXPECT_THAT(test::message_of([&] {
                test::run_command({"mesh", "import", nodes, elements, "-o", mesh});
              }),
              HasSubstr("a.exnode: line 2"));
  EXPECT_FALSE(std::filesystem::exists(mesh));
}

}  // namespace
}  // namespace diastole
