// `diastole fibres`: from a folder of images to files, to a study's model, and what it refuses.

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "estimator/io/fibre_points.hpp"
#include "estimator/model/study_model.hpp"
#include "tests/estimator/cli/run_command.hpp"
#include "tests/estimator/imaging/diffusion_scan.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class FibresCommand : public testing::Test {
 protected:
  FibresCommand() {
    std::filesystem::create_directory(folder_.path() / "dicom");
    scan_.noise = 50;
    scan_.missing = {{6, 4}};
    test::write_dicom(scan_, folder_.path() / "dicom");
    folder_.write("heart.study.toml", study("fibre_endo_deg = 0.0\nfibre_epi_deg = 0.0\n"));
  }

  static std::string study(const std::string& fibres) {
    return "format = \"diastole-study\"\nversion = 1\n[specimen]\nkind = \"ellipsoid\"\ninner_axes_mm = "
           "[21.0, 51.0]\n"
           "outer_axes_mm = [30.0, 60.0]\nbase_z_mm = 15.0\nmesh = [8, 4, 2]\nends = \"fixed\"\n" +
           fibres +
           "[law]\nname = \"guccione\"\n[law.parameters.C_kPa]\nstart = 2.0\nbounds = [1.0, 15.0]\n"
           "[law.parameters.b1]\nstart = 8.0\nbounds = [1.0, 15.0]\n"
           "[law.parameters.b2]\nstart = 2.0\nbounds = [1.0, 15.0]\n"
           "[law.parameters.b3]\nstart = 4.0\nbounds = [1.0, 15.0]\n"
           "[images.to_specimen]\norigin_mm = [4.0, -7.0, 11.0]\nx_axis = [1.0, 0.0, 0.0]\ny_axis = [0.0, "
           "1.0, 0.0]\n"
           "z_axis = [0.0, 0.0, 1.0]\n";
  }

  [[nodiscard]] std::string path(const std::string& name) const { return (folder_.path() / name).string(); }

  std::string output(std::vector<std::string> more) const {
    std::vector<std::string> arguments{"fibres", path("dicom")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return test::run_command(arguments).output;
  }

  std::string refusal(const std::vector<std::string>& more) const {
    return test::message_of([&] { (void)output(more); });
  }

  test::ScratchFolder folder_;
  test::DiffusionScan scan_;
};

TEST_F(FibresCommand, MeasuresAFieldThatAStudyTakes) {
  const auto reported =
      nlohmann::json::parse(output({"--study", path("heart.study.toml"), "-o", path("heart.fibres.csv"),
                                    "--tensors", path("tensors.csv"), "--page", path("page.html"), "--record",
                                    path("record.json"), "--grid", path("fibres.vtkhdf"), "--json"}));
  EXPECT_EQ(reported["b_values"], (std::vector<double>{0, 1000}));
  EXPECT_EQ(reported["directions"], 12);
  EXPECT_TRUE(reported["outliers"].empty());
  EXPECT_EQ(reported["axis_check"]["ok"], true);
  EXPECT_GT(reported["rms_deg"], 1.0);
  EXPECT_EQ(reported["problems"][0]["id"], "image-missing");
  for (const char* file : {"heart.fibres.csv", "tensors.csv", "page.html", "record.json", "fibres.vtkhdf"})
    EXPECT_GT(std::filesystem::file_size(path(file)), 1000U) << file;
  EXPECT_THAT(test::run_command({"report", path("record.json"), "-o", path("again.html")}).output,
              HasSubstr("again.html"));

  // The study's own fibres, back from its file: helix +60 to -60 degrees.
  folder_.write("measured.study.toml", study("fibres = \"heart.fibres.csv\"\n"));
  (void)test::run_command({"mesh", "export", path("measured.study.toml"), "-o", path("measured.mesh.toml")});
  std::ifstream mesh(path("measured.mesh.toml"));
  std::stringstream text;
  text << mesh.rdbuf();
  EXPECT_THAT(text.str(), HasSubstr("transverse_deg"));
  folder_.write("assumed.study.toml", study("fibre_endo_deg = 60.0\nfibre_epi_deg = -60.0\n"));
  const auto volume_mL = [&](const char* name) {
    return nlohmann::json::parse(test::run_command({"solve", path(name), "--pressure-kPa", "0.5", "--json"})
                                     .output)["cavity_volume_change_mL"]
        .get<double>();
  };
  const double assumed = volume_mL("assumed.study.toml");
  EXPECT_NEAR(volume_mL("measured.study.toml"), assumed, 0.02 * assumed);
  EXPECT_GT(std::abs(volume_mL("heart.study.toml") - assumed), 0.05 * assumed);
}

TEST_F(FibresCommand, FibresOfAnotherSpecimenAreTold) {
  (void)output({"--study", path("heart.study.toml"), "-o", path("heart.fibres.csv")});
  std::vector<FibrePointRow> rows = read_fibre_points(path("heart.fibres.csv"));
  const auto reported = [&] {
    folder_.write("other.fibres.csv", fibre_points_text(rows));
    folder_.write("other.study.toml", study("fibres = \"other.fibres.csv\"\n"));
    std::string ids;
    for (const Finding& finding : fibre_findings(read_study(path("other.study.toml"))))
      ids += finding.id + " ";
    return ids;
  };
  EXPECT_EQ(reported(), "");
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  for (FibrePointRow& row : rows) {
    const Eigen::Vector3d any = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    row.direction = {any.x(), any.y(), any.z()};
  }
  EXPECT_EQ(reported(), "fibres-misfit ");
  for (size_t i = 0; i < rows.size(); i += 2)
    rows[i].place_mm[0] += 500;
  EXPECT_EQ(reported(), "fibres-beside fibres-misfit ");
}

TEST_F(FibresCommand, GivesTheFieldAtPlaces) {
  const Eigen::Vector3d place = scan_.origin_mm + Eigen::Vector3d(25.5, 0, 0);
  folder_.write("at.csv", "x_mm,y_mm,z_mm\n" + std::to_string(place.x()) + "," + std::to_string(place.y()) +
                              "," + std::to_string(place.z()) + "\n");
  (void)output({"--study", path("heart.study.toml"), "--at", path("at.csv"), "-o", path("one.fibres.csv")});
  const std::vector<FibrePointRow> rows = read_fibre_points(path("one.fibres.csv"));
  ASSERT_EQ(rows.size(), 1U);
  const double cosine = std::abs(scan_.fibre(place)->dot(Eigen::Vector3d(rows[0].direction.data())));
  EXPECT_GT(cosine, std::cos(6 * M_PI / 180));
  EXPECT_GT(rows[0].sigma_deg, 0.2);
  EXPECT_LT(rows[0].sigma_deg, 6);
  folder_.write("out.csv", "x_mm,y_mm,z_mm\n0,0,900\n");
  EXPECT_THAT(
      refusal({"--study", path("heart.study.toml"), "--at", path("out.csv"), "-o", path("two.fibres.csv")}),
      AllOf(HasSubstr("out.csv"), HasSubstr("line 2"), HasSubstr("outside")));
  EXPECT_FALSE(std::filesystem::exists(path("two.fibres.csv")));
}

TEST_F(FibresCommand, RefusesWithPlaceAndRemedy) {
  EXPECT_THAT(refusal({}), HasSubstr("-o"));
  EXPECT_THAT(refusal({"-o", path("a.fibres.csv")}), AllOf(HasSubstr("-o"), HasSubstr("--mesh")));
  EXPECT_THAT(refusal({"--tensors", path("t.csv"), "--axes", "up"}), HasSubstr("--axes up"));
  EXPECT_THAT(refusal({"--tensors", path("t.csv"), "--series", "9"}), HasSubstr("--series 9"));
  EXPECT_THAT(refusal({"--tensors", path("heart.study.toml")}), HasSubstr("heart.study.toml"));
  EXPECT_THAT(refusal({"--tensors", path("t.csv"), "--at", path("heart.study.toml")}), HasSubstr("--at"));
  EXPECT_THAT(
      refusal({"--study", path("heart.study.toml"), "--mesh", path("x.mesh"), "-o", path("a.fibres.csv")}),
      HasSubstr("two ventricles"));
  const auto file = folder_.path() / "dicom" / "im020.dcm";
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  EXPECT_THAT(refusal({"--tensors", path("t.csv")}), HasSubstr("im020.dcm"));
  EXPECT_FALSE(std::filesystem::exists(path("t.csv")));
}

TEST_F(FibresCommand, StudiesWithWrongFibresAreRefused) {
  const auto solving = [&](const std::string& fibres, const std::string& csv) {
    folder_.write("bad.study.toml", study(fibres));
    folder_.write("bad.fibres.csv", csv);
    return test::message_of([&] {
      test::run_command({"mesh", "export", path("bad.study.toml"), "-o", path("bad.mesh.toml"), "--force"});
    });
  };
  const std::string key = "fibres = \"bad.fibres.csv\"\n", header = std::string(fibre_points_mark) + "\n";
  EXPECT_THAT(solving(key, "x,y\n"), HasSubstr("bad.fibres.csv"));
  EXPECT_THAT(solving(key, header + "1,2,3,1,1,0,2\n"), AllOf(HasSubstr("line 2"), HasSubstr("length")));
  EXPECT_THAT(solving(key, header + "1,2,3,1,0,0,0\n"), HasSubstr("sigma_deg"));
  EXPECT_THAT(solving(key, header + "500,0,0,1,0,0,2\n"),
              AllOf(HasSubstr("specimen.fibres"), HasSubstr("0 of 1 points")));
  EXPECT_THAT(solving(key + "fibre_endo_deg = 3.0\n", header), HasSubstr("fibre_endo_deg"));
  EXPECT_THAT(solving("fibres = \"none.csv\"\n", header), HasSubstr("none.csv"));
}

}  // namespace
}  // namespace diastole
