// `--unload` of solve, fit and mesh export: a ventricle that was imaged under load.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "estimator/cli/unloading_output.hpp"
#include "tests/estimator/cli/run_command.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string imaged_ventricle(const std::string& more, const std::string& C_kPa = "3.0") {
  return "format = \"diastole-study\"\nversion = 1\n[specimen]\nkind = \"ellipsoid\"\n"
         "inner_axes_mm = [21.0, 51.0]\nouter_axes_mm = [30.0, 60.0]\nbase_z_mm = 15.0\n"
         "fibre_endo_deg = 60.0\nfibre_epi_deg = -60.0\nmesh = [5, 3, 1]\nends = \"fixed\"\n" +
         more + "[law]\nname = \"guccione\"\n[law.parameters.C_kPa]\nstart = " + C_kPa +
         "\nbounds = [0.001, 15.0]\n[law.parameters.b1]\nstart = 11.09\nbounds = [1.0, 35.0]\n"
         "[law.parameters.b2]\nstart = 1.76\nbounds = [0.5, 15.0]\n"
         "[law.parameters.b3]\nstart = 10.0\nbounds = [1.0, 35.0]\n";
}

nlohmann::json said(const std::vector<std::string>& arguments, ExitCode code = ExitCode::done) {
  const test::Outcome outcome = test::run_command(arguments);
  EXPECT_EQ(outcome.code, code);
  return nlohmann::json::parse(outcome.output);
}

TEST(UnloadCommand, SolvesFromTheShapeWithoutLoad) {
  const test::ScratchFolder folder;
  const std::string study =
      folder.write("heart.study.toml", imaged_ventricle("imaged_at_kPa = 1.2\n")).string();
  const auto solved =
      said({"solve", study, "--unload", "--pressure-kPa", "1.2", "--probe", "0,-21,0", "--json"});
  EXPECT_EQ(solved["unloaded"]["reason"], "converged");
  EXPECT_TRUE(solved["unloaded"]["returned"]);
  EXPECT_LT(solved["unloaded"]["return_mm"].get<double>(), 0.02);
  EXPECT_NEAR(solved["cavity_volume_mL"].get<double>(), solved["unloaded"]["cavity_imaged_mL"].get<double>(),
              1e-3);
  EXPECT_LT(solved["unloaded"]["cavity_unloaded_mL"].get<double>(),
            0.9 * solved["unloaded"]["cavity_imaged_mL"].get<double>());
  EXPECT_LT(solved["probes"][0]["displacement_mm"][1].get<double>(), -1.0);  // outwards

  const std::string mesh = (folder.path() / "unloaded.mesh.toml").string();
  const auto exported = said({"mesh", "export", study, "--unload", "-o", mesh, "--json"});
  EXPECT_THAT(exported["remarks"][1].get<std::string>(), HasSubstr("Fibres carried with the material"));
  std::string text = imaged_ventricle("");
  const size_t kind = text.find("kind"), ends = text.find("ends");
  text.replace(kind, ends - kind, "kind = \"mesh\"\nfile = \"unloaded.mesh.toml\"\n");
  const std::string from_file = folder.write("unloaded.study.toml", text).string();
  const auto again = said({"solve", from_file, "--pressure-kPa", "1.2", "--json"});
  EXPECT_NEAR(again["cavity_volume_mL"].get<double>() / solved["cavity_volume_mL"].get<double>(), 1.0, 2e-3);
}

TEST(UnloadCommand, SaysWhenThereIsNoSuchShape) {
  const test::ScratchFolder folder;
  const std::string study =
      folder.write("soft.study.toml", imaged_ventricle("imaged_at_kPa = 30.0\n", "0.01")).string();
  testing::internal::CaptureStderr();
  const auto solved = said({"solve", study, "--unload", "--pressure-kPa", "1", "--json"}, ExitCode::negative);
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("no shape without load"));
  EXPECT_EQ(solved["reason"], "no shape without load");
  EXPECT_FALSE(solved["unloaded"]["returned"]);
  EXPECT_LT(solved["unloaded"]["reached_pressure_kPa"].get<double>(), 30.0);
}

TEST(UnloadCommand, AFitSaysThatTheImageComesBackOnlyWhereItDoes) {
  FittedUnloading unloaded{1.2, 0.05, 1.21, 0.04, 60.0, 50.0, 2e-9, true};
  EXPECT_THAT(unloading_sentence(unloaded), HasSubstr("bring the image back to 2e-09 mm"));
  unloaded.returned = false;
  unloaded.return_mm = 7.0;
  EXPECT_THAT(unloading_sentence(unloaded), Not(HasSubstr("back")));
}

TEST(UnloadCommand, IsRefusedWhereTheLoadIsNotKnown) {
  const test::ScratchFolder folder;
  const auto message = [&](const std::string& more) {
    const std::string study = folder.write("heart.study.toml", imaged_ventricle(more)).string();
    return test::message_of([&] { test::run_command({"solve", study, "--unload", "--pressure-kPa", "1"}); });
  };
  EXPECT_THAT(message(""), HasSubstr("specimen.imaged_at_kPa"));
  EXPECT_THAT(message("imaged_at_sigma_kPa = 0.1\n"), HasSubstr("stands without imaged_at_kPa"));
  EXPECT_THAT(message("imaged_at_kpa = 1.2\n"), HasSubstr("imaged_at_kPa"));
  EXPECT_THAT(message("imaged_at_kPa = 1.2\n[chamber]\n"), HasSubstr("chamber"));
}

}  // namespace
}  // namespace diastole
