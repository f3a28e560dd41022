#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "estimator/mesh/annulus.hpp"
#include "estimator/mesh/mesh_file.hpp"
#include "tests/estimator/cli/run_command.hpp"
#include "tests/estimator/io/gel_study.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using test::gel_study;
using test::Outcome;

class SolveCommand : public testing::Test {
 protected:
  SolveCommand() { write_study(gel_study); }

  void write_study(const std::string& text) const { std::ofstream(study_) << text; }

  void make_anisotropic() const {
    std::ostringstream text;
    text << std::ifstream(study_).rdbuf();
    std::string study = text.str();
    const size_t law = study.find("name = \"neo-hookean\"");
    std::string guccione = "name = \"guccione\"\n";
    for (const char* parameter : {"C_kPa", "b1", "b2", "b3"})
      guccione += std::string("[law.parameters.") + parameter + "]\nstart = 5.0\nbounds = [1.0, 15.0]\n";
    write_study(study.replace(law, study.find("[data]") - law, guccione));
  }

  Outcome run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"solve", study_.string()});
    return test::run_command(std::move(arguments));
  }

  std::string refusal(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"solve", study_.string()});
    return refusal_of(arguments);
  }

  static std::string refusal_of(const std::vector<std::string>& arguments) {
    return test::message_of([&] { (void)test::run_command(arguments); });
  }

  /// What standard error is told.
  std::string remarks(const std::vector<std::string>& arguments) const {
    testing::internal::CaptureStderr();
    (void)run(arguments);
    return testing::internal::GetCapturedStderr();
  }

  test::ScratchFolder folder_;
  std::filesystem::path study_ = folder_.path() / "gel.study.toml";
};

TEST_F(SolveCommand, JsonHoldsWhatTheContractSays) {
  const Outcome outcome = run({"--pressure-kPa", "6", "--probe", "22.5,0,0", "--probe", "-50,0,0", "--json"});
  EXPECT_EQ(outcome.code, ExitCode::done);
  const nlohmann::json json = nlohmann::json::parse(outcome.output);
  EXPECT_NEAR(json["cavity_volume_change_mL"].get<double>(), 78.351, 0.5);
  EXPECT_EQ(json["dofs"], 1792);
  EXPECT_EQ(json["factorisations"], 1);
  EXPECT_LE(json["newton_iterations"], 16);  // the tangent's own step and those with its kept factor
  EXPECT_GT(json["seconds"].get<double>(), 0.0);
  EXPECT_EQ(json["reason"], "converged");
  EXPECT_EQ(json["negative_pivots"], json["pressure_unknowns"]);
  EXPECT_EQ(json["mesh"], nlohmann::json({8, 4, 1}));
  ASSERT_EQ(json["probes"].size(), 2U);
  EXPECT_NEAR(json["probes"][0]["displacement_mm"][0].get<double>(), 8.0557, 0.08);
  EXPECT_NEAR(json["probes"][1]["displacement_mm"][0].get<double>(), -4.2197, 0.04);
}

TEST_F(SolveCommand, JsonHoldsWhatIsRemarkedOnTheModel) {
  const std::vector<std::string> solve = {"--pressure-kPa", "1", "--mesh", "4,1,1", "--json"};
  EXPECT_TRUE(nlohmann::json::parse(run(solve).output)["findings"].empty());
  write_study(std::string(gel_study) + "[model]\neffects = [\"viscoelasticity\"]\n");
  testing::internal::CaptureStderr();
  const nlohmann::json findings = nlohmann::json::parse(run(solve).output)["findings"];
  EXPECT_THAT(testing::internal::GetCapturedStderr(), testing::HasSubstr("viscoelasticity"));
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0]["id"], "effect-of-recordings");
}

TEST_F(SolveCommand, NeedsNoData) {
  const std::string text = gel_study;
  write_study(text.substr(0, text.find("[data]")));
  EXPECT_EQ(run({"--pressure-kPa", "1", "--mesh", "4,1,1"}).code, ExitCode::done);
}

TEST_F(SolveCommand, SetAndMeshReplaceTheStudys) {
  const nlohmann::json json = nlohmann::json::parse(
      run({"--pressure-kPa", "3.1", "--set", "C1_kPa=8.8", "--mesh", "6,2,1", "--json"}).output);
  EXPECT_EQ(json["parameters"]["C1_kPa"], 8.8);
  EXPECT_EQ(json["mesh"], nlohmann::json({6, 2, 1}));
  EXPECT_LT(json["cavity_volume_change_mL"].get<double>(), 30.0);
}

TEST_F(SolveCommand, TellsAPersonInWords) {
  const Outcome outcome = run({"--pressure-kPa", "2", "--probe", "30,0,0"});
  EXPECT_EQ(outcome.code, ExitCode::done);
  EXPECT_THAT(outcome.output, testing::HasSubstr("At 2 kPa the cavity has taken"));
  EXPECT_THAT(outcome.output, testing::HasSubstr("X = (30, 0, 0) mm moved by ("));
}

TEST_F(SolveCommand, TellsStrainAndStressAtAProbe) {
  const auto json =
      nlohmann::json::parse(run({"--pressure-kPa", "6", "--probe", "22.5,0,0", "--json"}).output);
  const auto& fields = json["probes"][0]["fields"];
  EXPECT_NEAR(fields["stress_rr_kPa"].get<double>(), -6.0, 0.2);
  EXPECT_NEAR(fields["stress_cc_kPa"].get<double>(), 9.6, 0.2);
  const double u_mm = json["probes"][0]["displacement_mm"][0];
  const double stretch = 1.0 + u_mm / 22.5;
  EXPECT_NEAR(fields["strain_cc"].get<double>(), 0.5 * (stretch * stretch - 1.0), 1e-3);
  EXPECT_FALSE(fields.contains("stress_ff_kPa")) << "the gel has no fibres";
}

TEST_F(SolveCommand, WritesTheFilesThatAreAskedFor) {
  const test::ScratchFolder folder;
  const std::string grid = (folder.path() / "gel.vtkhdf").string();
  const std::string table = (folder.path() / "gel.csv").string();
  const std::string record = (folder.path() / "gel.json").string();
  const std::vector<std::string> arguments{
      "--pressure-kPa", "2", "--mesh", "4,1,1", "-o", grid, "-o", table, "-o", record};
  EXPECT_THAT(run(arguments).output, testing::HasSubstr("Written: " + grid));
  EXPECT_GT(std::filesystem::file_size(grid), 0);
  EXPECT_GT(std::filesystem::file_size(table), 0);
  EXPECT_EQ(nlohmann::json::parse(std::ifstream(record))["parameters"]["C1_kPa"], 6.5);
  EXPECT_EQ(run(arguments).code, ExitCode::done) << "earlier results are replaced";
  EXPECT_THAT(refusal({"--pressure-kPa", "2", "-o", "gel.stl"}),
              testing::HasSubstr(".vtkhdf (for ParaView)"));
  std::ofstream(table) << "a table of mine";
  EXPECT_THAT(refusal(arguments), testing::HasSubstr("gel.csv"));
}

TEST_F(SolveCommand, HalvesElementsOfTheSameBody) {
  const auto solved = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"--pressure-kPa", "0", "--mesh", "4,2,1", "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return nlohmann::json::parse(run(arguments).output);
  };
  const auto coarse = solved({});
  const auto fine = solved({"--refine", "1,0,1"});
  EXPECT_EQ(coarse["elements"], 8);
  EXPECT_EQ(fine["elements"], 32);
  EXPECT_NEAR(fine["cavity_volume_mL"].get<double>(), coarse["cavity_volume_mL"].get<double>(), 1e-9);
  EXPECT_THAT(refusal({"--pressure-kPa", "2", "--refine", "1,1"}), testing::HasSubstr("three whole numbers"));
  EXPECT_THAT(refusal({"--pressure-kPa", "2", "--refine", "0,5,0"}), testing::HasSubstr("0 to 4"));
  write_study(std::string(gel_study) + "[model]\nrefine = [0, 1, 0]\n");
  EXPECT_EQ(solved({})["elements"], 16);
}

TEST_F(SolveCommand, FollowsTheStudysFrames) {
  const test::ScratchFolder folder;
  write_study(std::string(gel_study) + "frames = \"" +
              folder
                  .write("gel.frames.csv",
                         "frame,time_s,pressure_kPa,sigma_kPa\n0,0,0,0\n1,0.2,1,0.1\n2,0.4,2.5,0.1\n")
                  .string() +
              "\"\n");
  const std::string grid = (folder.path() / "gel.vtkhdf").string();
  const auto json = nlohmann::json::parse(run({"--frames", "--mesh", "4,1,1", "-o", grid, "--json"}).output);
  ASSERT_EQ(json["frames"].size(), 3U);
  EXPECT_NEAR(json["frames"][0]["cavity_volume_change_mL"].get<double>(), 0.0, 1e-9);
  EXPECT_EQ(json["frames"][2]["time_s"], 0.4);
  EXPECT_EQ(json["frames"][2]["cavity_volume_change_mL"], json["cavity_volume_change_mL"]);
  EXPECT_EQ(json["pressure_kPa"], 2.5);
  EXPECT_EQ(json["files"][0], grid);
  EXPECT_THAT(refusal({"--frames", "--pressure-kPa", "2"}), testing::HasSubstr("beside --frames"));
  EXPECT_THAT(refusal({}), testing::HasSubstr("--pressure-kPa"));
  write_study(gel_study);
  EXPECT_THAT(refusal({"--frames"}), testing::HasSubstr("data.frames"));
}

TEST_F(SolveCommand, NoEquilibriumIsANegativeAnswerWithAReason) {
  const test::ScratchFolder folder;
  const std::filesystem::path table = folder.path() / "gel.csv";
  testing::internal::CaptureStderr();
  const Outcome outcome = run({"--pressure-kPa", "100", "--mesh", "6,2,1", "-o", table.string(), "--json"});
  const std::string message = testing::internal::GetCapturedStderr();
  EXPECT_EQ(outcome.code, ExitCode::negative);
  const nlohmann::json json = nlohmann::json::parse(outcome.output);
  EXPECT_NE(json["reason"], "converged");
  EXPECT_FALSE(json.contains("files")) << "none was written";
  EXPECT_FALSE(std::filesystem::exists(table));
  EXPECT_THAT(message, testing::HasSubstr("was reached"));
  EXPECT_EQ(json["reason"], "limit point");
  EXPECT_THAT(message, testing::HasSubstr("pressure maximum near"));
  EXPECT_THAT(message, testing::HasSubstr("`diastole pv` leads the volume"));
}

TEST_F(SolveCommand, BlamesNoPressureMaximumWhereNoLoadWasBorne) {
  std::string text = gel_study;
  write_study(
      text.replace(text.find("ends = \"fixed\""), 14,
                   "ends = \"sprung\"\nbond_normal_kPa_per_mm = 0.0\nbond_tangential_kPa_per_mm = 0.0"));
  testing::internal::CaptureStderr();
  EXPECT_EQ(run({"--pressure-kPa", "1", "--mesh", "4,1,1"}).code, ExitCode::negative);
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              testing::AllOf(testing::HasSubstr("its supports or springs do not hold it"),
                             testing::Not(testing::HasSubstr("maximum"))));
}

TEST_F(SolveCommand, PullsAlongTheFibresOfABodyThatHasThem) {
  EXPECT_THAT(refusal({"--pressure-kPa", "1", "--fibre-tension-kPa", "5"}), testing::HasSubstr("no fibres"));
  EXPECT_THAT(refusal({"--pressure-kPa", "1", "--fibre-tension-kPa", "-5"}),
              testing::HasSubstr("not a tension"));
  std::string text = gel_study;
  const size_t kind = text.find("kind =");
  write_study(
      text.replace(kind, text.find("ends =") - kind,
                   "kind = \"ellipsoid\"\ninner_axes_mm = [21.0, 51.0]\nouter_axes_mm = [30.0, 60.0]\n"
                   "base_z_mm = 15.0\nfibre_endo_deg = 60.0\nfibre_epi_deg = -60.0\nmesh = [4, 2, 1]\n"));
  make_anisotropic();
  const auto solved = [&](const char* tension_kPa) {
    return nlohmann::json::parse(
        run({"--pressure-kPa", "0.3", "--fibre-tension-kPa", tension_kPa, "--json"}).output);
  };
  const auto passive = solved("0");
  const auto active = solved("2");
  EXPECT_EQ(active["fibre_tension_kPa"], 2.0);
  EXPECT_EQ(active["stable"], true);
  EXPECT_GT(passive["cavity_volume_change_mL"].get<double>(), 0.0);
  EXPECT_LT(active["cavity_volume_change_mL"].get<double>(), 0.0);
}

// The gel's pressures have more negative pivots than unknowns there (decision 0010): its wall is thick, and stays round.
TEST_F(SolveCommand, DoesNotCallSuctionOfTheGelUnstable) {
  const auto json = nlohmann::json::parse(run({"--pressure-kPa", "-6", "--json"}).output);
  EXPECT_EQ(json["reason"], "converged");
  EXPECT_EQ(json["unstable_motions"], 0);
  EXPECT_THAT(remarks({"--pressure-kPa", "-6"}), testing::Not(testing::HasSubstr("not stable")));
}

// Between frictionless plates a ring of stiffness E' = 8 C1 (plane strain) buckles at E' t^3 / (4 R^3) of outside pressure:
// 3.5 Pa, into an oval in two directions.
TEST_F(SolveCommand, WarnsOfAThinRingThatBucklesUnderOutsidePressure) {
  std::string text = gel_study;
  const auto set = [&](const std::string& old, const std::string& now) {
    text.replace(text.find(old), old.size(), now);
  };
  set("outer_radius_mm = 50.0", "outer_radius_mm = 24.0");
  set("height_mm = 85.0", "height_mm = 4.0");
  set("[8, 4, 1]", "[12, 1, 1]");
  set("ends = \"fixed\"",
      "ends = \"sprung\"\nbond_normal_kPa_per_mm = 1000.0\nbond_tangential_kPa_per_mm = 1e-6");
  write_study(text);
  EXPECT_EQ(remarks({"--pressure-kPa", "-0.002"}), "");
  EXPECT_THAT(remarks({"--pressure-kPa", "-0.007"}),
              testing::HasSubstr("not stable: in 2 independent motions"));
}

TEST_F(SolveCommand, AsksWhetherLengthsAndPressuresAreInTheRightUnit) {
  EXPECT_THAT(remarks({"--pressure-kPa", "6000", "--mesh", "4,1,1"}),
              testing::AllOf(testing::HasSubstr("was reached"), testing::HasSubstr("1 kPa = 1000 Pa")));
  std::string text = gel_study;
  for (const auto& [mm, m] : {std::pair{"22.5", "0.0225"}, {"50.0", "0.05"}, {"85.0", "0.085"}})
    text.replace(text.find(mm), std::string(mm).size(), m);
  write_study(text);
  EXPECT_THAT(remarks({"--pressure-kPa", "1", "--mesh", "4,1,1"}),
              testing::AllOf(testing::HasSubstr("0.1 mm"), testing::HasSubstr("metres")));
}

TEST_F(SolveCommand, TellsTheForcesThatHoldTheSpecimen) {
  const nlohmann::json json =
      nlohmann::json::parse(run({"--pressure-kPa", "3", "--mesh", "6,2,1", "--json"}).output);
  const auto& forces = json["forces"];
  EXPECT_LT(forces["unbalanced_N"].get<double>(), 1e-6);
  EXPECT_NEAR(forces["supports_N"]["bottom"][2].get<double>(), -forces["supports_N"]["top"][2].get<double>(),
              1e-6);
  EXPECT_GT(json["stored_energy_mJ"].get<double>(), 0.0);
  EXPECT_FALSE(json.contains("chamber_pressure_kPa"));
}

TEST_F(SolveCommand, FindsThePressureOfAVolumeInASealedChamberOnSprings) {
  std::string text = gel_study;
  text.replace(text.find("ends = \"fixed\""), 14,
               "ends = \"sprung\"\nbond_normal_kPa_per_mm = 40.0\nbond_tangential_kPa_per_mm = 12.5");
  write_study(text + "[chamber]\ncompliance_mL_per_kPa = 30.0\n[model]\nbulk_modulus_kPa = 2000.0\n");
  const Outcome outcome = run({"--volume-change-mL", "15", "--mesh", "6,2,1", "--json"});
  EXPECT_EQ(outcome.code, ExitCode::done);
  const nlohmann::json json = nlohmann::json::parse(outcome.output);
  EXPECT_NEAR(json["cavity_volume_change_mL"].get<double>(), 15.0, 1e-9);
  EXPECT_GT(json["pressure_kPa"].get<double>(), 1.0);
  EXPECT_NEAR(json["chamber_pressure_kPa"].get<double>(), json["chamber_intake_mL"].get<double>() / 30.0,
              1e-9);
  EXPECT_LT(json["chamber_intake_mL"].get<double>(), 15.0);
  EXPECT_LT(json["forces"]["unbalanced_N"].get<double>(), 1e-6);
  EXPECT_EQ(json["negative_pivots"], json["pressure_unknowns"]);
}

/// A study of a ring's mesh file, from which some face names are taken.
class SolveOfAMeshFile : public SolveCommand {
 protected:
  void leave_out(const std::vector<std::string>& names, const std::string& more = "") const {
    AnnulusShape shape;
    shape.elements = {4, 1, 1};
    HermiteMesh ring = make_annulus(shape);
    MeshFaces faces = ring.faces();
    for (const std::string& name : names) {
      if (name == "inner") faces.inner.clear();
      if (name == "outer") faces.outer.clear();
      if (name == "top") faces.top.clear();
      if (name == "bottom") faces.bottom.clear();
    }
    write_ring(ring, ring.reference(), faces, "ends = \"fixed\"\n", more);
  }

  /// On springs, its top pushed up by so much at one node.
  void dent(double height_mm) const {
    AnnulusShape shape;
    shape.elements = {4, 1, 1};
    const HermiteMesh ring = make_annulus(shape);
    NodeField reference = ring.reference();
    reference[dof_of(4, 0, 2)] += height_mm;
    write_ring(ring, reference, ring.faces(),
               "ends = \"sprung\"\nbond_normal_kPa_per_mm = 3.0\nbond_tangential_kPa_per_mm = 2.0\n", "");
  }

  void write_ring(const HermiteMesh& ring, const NodeField& reference, const MeshFaces& faces,
                  const std::string& ends, const std::string& more) const {
    std::vector<HermiteMesh::Corners> elements;
    for (size_t e = 0; e < ring.element_count(); ++e)
      elements.push_back(ring.element(e));
    const std::filesystem::path mesh =
        folder_.write("ring.mesh.toml", mesh_file_text({HermiteMesh(reference, elements, faces), {}}));
    const std::string text = gel_study;
    write_study(text.substr(0, text.find("kind =")) + "kind = \"mesh\"\nfile = \"" + mesh.string() + "\"\n" +
                ends + text.substr(text.find("[law]")) + more);
  }

  const std::string sealed_ = "[chamber]\ncompliance_mL_per_kPa = 30.0\n";
};

TEST_F(SolveOfAMeshFile, RefusesALoadThatTheFacesCannotTake) {
  const auto refused_for = [](const std::string& what) {
    return testing::AllOf(testing::HasSubstr(".study.toml"), testing::HasSubstr("specimen.file"),
                          testing::HasSubstr(what), testing::HasSubstr("Name "));
  };
  leave_out({"inner"});
  EXPECT_THAT(refusal({"--pressure-kPa", "1"}), refused_for("names no face inner"));
  EXPECT_THAT(refusal({"--volume-change-mL", "1"}), refused_for("names no face inner"));
  leave_out({"top"});
  EXPECT_THAT(refusal({"--volume-change-mL", "1"}), refused_for("cavity has no volume"));
  EXPECT_THAT(refusal_of({"pv", study_.string(), "--volume-change-mL", "1"}),
              refused_for("cavity has no volume"));
  leave_out({"top"}, sealed_);
  EXPECT_THAT(refusal({"--pressure-kPa", "1"}), refused_for("sealed [chamber] has no volume"));
  leave_out({"outer"}, sealed_);
  EXPECT_THAT(refusal({"--pressure-kPa", "1"}), refused_for("names no face outer"));
  leave_out({"outer"}, "[chamber]\nsealing_pressure_kPa = 1.0\n");
  EXPECT_THAT(refusal({"--pressure-kPa", "1"}), refused_for("names no face outer"));
}

TEST_F(SolveOfAMeshFile, RefusesABodyThatNothingHolds) {
  leave_out({"bottom", "top"});
  EXPECT_THAT(refusal({"--pressure-kPa", "1"}), testing::AllOf(testing::HasSubstr("specimen.file"),
                                                               testing::HasSubstr("nothing holds the body"),
                                                               testing::HasSubstr("bottom xi2=0")));
}

TEST_F(SolveOfAMeshFile, RefusesALawThatNeedsFibres) {
  leave_out({});
  make_anisotropic();
  EXPECT_THAT(refusal({"--pressure-kPa", "1"}),
              testing::AllOf(testing::HasSubstr("law.name"), testing::HasSubstr("no fibre_deg"),
                             testing::HasSubstr("neo-hookean")));
}

TEST_F(SolveOfAMeshFile, RefusesSpringsAtEndsThatAreNotPlane) {
  dent(0.0);
  EXPECT_EQ(run({"--pressure-kPa", "0.5"}).code, ExitCode::done);
  dent(0.4);
  EXPECT_THAT(refusal({"--pressure-kPa", "0.5"}),
              testing::AllOf(testing::HasSubstr("specimen.ends"),
                             testing::HasSubstr("the faces top are not in one plane across z"),
                             testing::HasSubstr("42.9 mm"), testing::HasSubstr("ends = \"fixed\"")));
}

TEST_F(SolveOfAMeshFile, TellsNoVolumeOfAnOpenCavity) {
  leave_out({"top"});
  const test::ScratchFolder results;
  const std::string record = (results.path() / "ring.json").string();
  const nlohmann::json json =
      nlohmann::json::parse(run({"--pressure-kPa", "0.5", "-o", record, "--json"}).output);
  EXPECT_EQ(json["reason"], "converged");
  EXPECT_TRUE(json.at("unstable_motions").is_null()) << "a pressure on a free rim has no potential";
  EXPECT_TRUE(json.at("stable").is_null());
  EXPECT_TRUE(json.at("cavity_volume_mL").is_null());
  EXPECT_TRUE(json.at("cavity_volume_change_mL").is_null());
  EXPECT_TRUE(nlohmann::json::parse(std::ifstream(record)).at("cavity_volume_mL").is_null());
  EXPECT_EQ(test::run_command({"report", record, "-o", (results.path() / "ring.html").string()}).code,
            ExitCode::done);
  EXPECT_THAT(run({"--pressure-kPa", "0.5"}).output,
              testing::AllOf(testing::HasSubstr("At 0.5 kPa"), testing::HasSubstr("open"),
                             testing::Not(testing::HasSubstr("has taken"))));
}

TEST_F(SolveOfAMeshFile, ClosedFacesTakePressureVolumeAndSealedChamber) {
  leave_out({}, sealed_);
  const nlohmann::json json = nlohmann::json::parse(run({"--volume-change-mL", "2", "--json"}).output);
  EXPECT_EQ(json["reason"], "converged");
  EXPECT_NEAR(json["cavity_volume_change_mL"].get<double>(), 2.0, 1e-9);
  leave_out({"inner"});
  EXPECT_EQ(run({"--pressure-kPa", "0"}).code, ExitCode::done) << "no pressure needs no wall";
}

TEST_F(SolveCommand, RefusesBadProbesWithARemedy) {
  EXPECT_THAT(refusal({"--pressure-kPa", "2", "--probe", "22.5,0"}),
              testing::HasSubstr("is not three numbers"));
  EXPECT_THAT(refusal({"--pressure-kPa", "2", "--probe", "1,2,nan"}),
              testing::HasSubstr("is not three numbers"));
  EXPECT_THAT(refusal({"--pressure-kPa", "2", "--probe", "1,2,3"}),
              testing::HasSubstr("outside the undeformed specimen"));
}

TEST_F(SolveCommand, RefusesBadPressureStartAndMesh) {
  EXPECT_THAT(refusal({"--volume-change-mL", "3", "--pressure-kPa", "3"}),
              testing::HasSubstr("is given beside --volume-change-mL"));
  EXPECT_THAT(refusal({"--pressure-kPa", "2", "--set", "C2_kPa=1"}), testing::HasSubstr("C2_kPa"));
  EXPECT_THAT(refusal({"--pressure-kPa", "2", "--mesh", "2,1,1"}), testing::HasSubstr("--mesh"));
}

TEST_F(SolveCommand, RefusesALawThatNeedsFibresInABodyWithoutAny) {
  make_anisotropic();
  EXPECT_THAT(
      refusal({"--pressure-kPa", "1"}),
      testing::AllOf(testing::HasSubstr("law.name"), testing::HasSubstr("needs to know where the fibres run"),
                     testing::HasSubstr("diastole mesh export")));
}

TEST_F(SolveCommand, RefusesALawFileThatNeedsFibresAndAStartBeyondItsBounds) {
  const auto with_law = [&](const std::string& energy) {
    const auto file = folder_.write("own.law.toml", R"toml(
format = "diastole-law"
version = 1
id = "own"
energy_kPa = ")toml" + energy + R"toml("
[[parameter]]
name = "C1_kPa"
unit = "kPa"
bounds = [0, 5]
typical = 3
)toml");
    std::string study = gel_study;
    study.replace(study.find("name = \"neo-hookean\""), 20, "file = \"" + file.string() + "\"");
    write_study(study);
  };
  with_law("C1_kPa * (I1 - 3) + if(lambda_f > 1.3, C1_kPa * (lambda_f - 1.3)^2, 0)");
  EXPECT_THAT(refusal({"--pressure-kPa", "1", "--set", "C1_kPa=4"}),
              testing::AllOf(testing::HasSubstr("law.file"), testing::HasSubstr("where the fibres run")));
  with_law("C1_kPa * (I1 - 3)");
  EXPECT_THAT(
      refusal({"--pressure-kPa", "1"}),
      testing::AllOf(testing::HasSubstr("law.parameters.C1_kPa.start"), testing::HasSubstr("above 5")));
}

TEST_F(SolveCommand, RefusesUnknownLawsAndParametersWithTheNearestName) {
  std::string text = gel_study;
  text.replace(text.find("neo-hookean"), 11, "neo-hookian");
  write_study(text);
  EXPECT_THAT(refusal({"--pressure-kPa", "2"}), testing::HasSubstr("Did you mean \"neo-hookean\"?"));
  text = gel_study;
  text.replace(text.find("C1_kPa"), 6, "C2_kPa");
  write_study(text);
  EXPECT_THAT(refusal({"--pressure-kPa", "2"}), testing::HasSubstr("Did you mean \"C1_kPa\"?"));
}

}  // namespace
}  // namespace diastole
