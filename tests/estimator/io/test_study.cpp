#include <gmock/gmock.h>

#include "estimator/io/study.hpp"
#include "tests/estimator/io/gel_study.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using test::message_of;
using testing::AllOf;
using testing::HasSubstr;

const std::string gel = std::string(test::gel_study) + R"(runs = ["a.run.h5", "b.run.h5"]
tags = "gel.tags.csv"
frames = "gel.frames.csv"
[model]
effects = []
)";

class StudyFile : public testing::Test {
 protected:
  Study read(const std::string& content) { return read_study(folder_.write("gel.study.toml", content)); }

  /// The message after `old` was replaced in the good study.
  std::string message_with(std::string_view old, std::string_view replacement) {
    std::string content = gel;
    const size_t at = content.find(old);
    EXPECT_NE(at, std::string::npos) << old;
    content.replace(at, old.size(), replacement);
    return message_of([&] { (void)read(content); });
  }

  test::ScratchFolder folder_;
};

TEST_F(StudyFile, EveryValueArrives) {
  const Study study = read(gel);
  const auto& annulus = std::get<AnnulusSpecimen>(study.specimen);
  EXPECT_EQ(annulus.inner_radius_mm, 22.5);
  EXPECT_EQ(annulus.outer_radius_mm, 50.0);
  EXPECT_EQ(annulus.height_mm, 85.0);
  EXPECT_THAT(annulus.mesh, testing::ElementsAre(8, 4, 1));
  EXPECT_EQ(study.law.name, "neo-hookean");
  ASSERT_EQ(study.law.parameters.size(), 1U);
  const StudyParameter& c1 = study.law.parameters[0];
  EXPECT_EQ(c1.name, "C1_kPa");
  EXPECT_EQ(c1.start, 6.5);
  EXPECT_EQ(c1.lower, 1.0);
  EXPECT_EQ(c1.upper, 15.0);
  EXPECT_EQ(c1.vary, Variation::whole);
  EXPECT_EQ(study.data.tags, folder_.path() / "gel.tags.csv");
  EXPECT_EQ(study.data.frames, folder_.path() / "gel.frames.csv");
  EXPECT_THAT(study.data.runs,
              testing::ElementsAre(folder_.path() / "a.run.h5", folder_.path() / "b.run.h5"));
  EXPECT_FALSE(study.data.points);
}

TEST_F(StudyFile, FaultsNamePlaceValueAndRemedy) {
  EXPECT_THAT(message_with("kind = \"annulus\"", "kind = \"anulus\""),
              AllOf(HasSubstr("gel.study.toml"), HasSubstr("line 4"), HasSubstr("specimen.kind"),
                    HasSubstr("\"anulus\""), HasSubstr("annulus")));
  EXPECT_THAT(message_with("height_mm", "heigth_mm"), AllOf(HasSubstr("height_mm")));
  EXPECT_THAT(message_with("outer_radius_mm = 50.0", "outer_radius_mm = 20.0"),
              AllOf(HasSubstr("outer_radius_mm"), HasSubstr("20"), HasSubstr("greater than 22.5")));
  EXPECT_THAT(message_with("[8, 4, 1]", "[800, 4, 1]"), AllOf(HasSubstr("mesh"), HasSubstr("800")));
  EXPECT_THAT(message_with("[8, 4, 1]", "[2, 4, 1]"), HasSubstr("circle"));
  EXPECT_THAT(message_with("start = 6.5", "start = 16.0"),
              AllOf(HasSubstr("start"), HasSubstr("at most 15")));
  EXPECT_THAT(message_with("[1.0, 15.0]", "[15.0, 1.0]"),
              AllOf(HasSubstr("bounds"), HasSubstr("not an interval")));
  EXPECT_THAT(message_with("\"whole\"", "\"node\""), AllOf(HasSubstr("vary"), HasSubstr("element")));
  EXPECT_THAT(message_with("frames = \"gel.frames.csv\"", ""),
              AllOf(HasSubstr("data.frames"), HasSubstr("missing")));
  EXPECT_THAT(message_with("effects = []", "efects = []"), AllOf(HasSubstr("efects"), HasSubstr("effects")));
  EXPECT_THAT(message_with("start = 6.5", "start = nan"), HasSubstr("start"));
}

TEST_F(StudyFile, SmoothnessArrivesAndCanBeSetOnTheCommandLine) {
  const auto with = [](std::string_view keys) {
    std::string content = gel;
    content.replace(content.find("vary = \"whole\""), 14, keys);
    return content;
  };
  const auto smoothness = [&](std::string_view keys) {
    return read(with(keys)).law.parameters[0].smoothness;
  };
  EXPECT_EQ(smoothness("vary = \"element\"").kind, Smoothness::Kind::evidence);
  EXPECT_EQ(smoothness("vary = \"element\"\nsmooth = \"none\"").kind, Smoothness::Kind::none);
  EXPECT_EQ(smoothness("vary = \"element\"\nsmooth_step = 0.05").step, 0.05);
  const auto fault = [&](std::string_view keys) { return message_of([&] { (void)read(with(keys)); }); };
  EXPECT_THAT(fault("vary = \"element\"\nsmooth = \"a lot\""),
              AllOf(HasSubstr("smooth"), HasSubstr("evidence")));
  EXPECT_THAT(fault("vary = \"element\"\nsmooth_step = 0.0"), HasSubstr("smooth_step"));
  EXPECT_THAT(fault("vary = \"element\"\nsmooth = \"none\"\nsmooth_step = 0.1"), HasSubstr("one of the two"));
  EXPECT_THAT(fault("vary = \"whole\"\nsmooth = \"none\""), HasSubstr("only one"));

  Study study = read(with("vary = \"element\""));
  set_smoothness(study, "0.2");
  EXPECT_EQ(study.law.parameters[0].smoothness.step, 0.2);
  set_smoothness(study, "none");
  EXPECT_EQ(study.law.parameters[0].smoothness.kind, Smoothness::Kind::none);
  for (const char* wrong : {"", "much", "-1", "0", "0.1x"})
    EXPECT_THAT(message_of([&] { set_smoothness(study, wrong); }), HasSubstr("--smooth")) << wrong;
}

TEST_F(StudyFile, StartAndMeshCanBeSetOnTheCommandLine) {
  Study study = read(gel);
  set_start(study, "C1_kPa=7.25");
  EXPECT_EQ(study.law.parameters[0].start, 7.25);
  set_mesh(study, "8,8,4");
  EXPECT_THAT(std::get<AnnulusSpecimen>(study.specimen).mesh, testing::ElementsAre(8, 8, 4));

  EXPECT_THAT(message_of([&] { set_start(study, "C1=7"); }), AllOf(HasSubstr("\"C1\""), HasSubstr("C1_kPa")));
  EXPECT_THAT(message_of([&] { set_start(study, "C1_kPa=70"); }), HasSubstr("bounds [1, 15]"));
  EXPECT_THAT(message_of([&] { set_start(study, "C1_kPa"); }), HasSubstr("NAME=NUMBER"));
  for (const char* wrong : {"8,4", "8,4,1,1", "8,4,x", "2,4,1", "8,0,1", "8,4,99"}) {
    EXPECT_THAT(message_of([&] { set_mesh(study, wrong); }), HasSubstr("--mesh")) << wrong;
  }
}

TEST(ExampleStudies, AreRead) {
  for (const char* name : {"phantom-a.study.toml", "phantom-a-points.study.toml"}) {
    EXPECT_NO_THROW((void)read_study(std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples" / name)) << name;
  }
}

TEST_F(StudyFile, SprungEndsChamberAndCompressionArrive) {
  std::string content = gel;
  content.replace(content.find("ends = \"fixed\""), 14,
                  "ends = \"sprung\"\nbond_normal_kPa_per_mm = 40.0\nbond_tangential_kPa_per_mm = 12.5");
  content +=
      "bulk_modulus_kPa = 2000.0\n[chamber]\nsealing_pressure_kPa = 0.5\ncompliance_mL_per_kPa = 30.0\n";
  const Study study = read(content);
  const auto& annulus = std::get<AnnulusSpecimen>(study.specimen);
  ASSERT_TRUE(annulus.end_springs);
  EXPECT_EQ(annulus.end_springs->normal_kPa_per_mm, 40.0);
  EXPECT_EQ(annulus.end_springs->tangential_kPa_per_mm, 12.5);
  ASSERT_TRUE(study.chamber);
  EXPECT_EQ(study.chamber->sealing_pressure_kPa, 0.5);
  EXPECT_EQ(study.chamber->compliance_mL_per_kPa, 30.0);
  EXPECT_EQ(study.compression.bulk_modulus_kPa, 2000.0);
  const Study plain = read(gel);
  EXPECT_FALSE(std::get<AnnulusSpecimen>(plain.specimen).end_springs);
  EXPECT_FALSE(plain.chamber);
  EXPECT_FALSE(plain.compression.bulk_modulus_kPa);
}

TEST_F(StudyFile, LoadsAndSupportsThatCannotBeAreRefused) {
  EXPECT_THAT(message_with("\"fixed\"", "\"sprung\""), HasSubstr("bond_normal_kPa_per_mm"));
  EXPECT_THAT(message_with("\"fixed\"", "\"sprung\"\nbond_normal_kPa_per_mm = -1.0"),
              HasSubstr("bond_normal_kPa_per_mm"));
  EXPECT_THAT(message_with("\"fixed\"", "\"fixed\"\nbond_normal_kPa_per_mm = 1.0"),
              HasSubstr("bond_normal_kPa_per_mm"));
  EXPECT_THAT(message_with("effects = []", "[chamber]\ncompliance_mL_per_kPa = 0.0"),
              HasSubstr("compliance_mL_per_kPa"));
  EXPECT_THAT(message_with("effects = []", "bulk_modulus_kPa = 0.0"), HasSubstr("bulk_modulus_kPa"));
  EXPECT_THAT(message_with("effects = []", "bulk_modulus_kPa = 100.0\nvolume_stiffness_kPa = 20.0"),
              HasSubstr("would add to the bulk modulus"));
}

constexpr const char* ventricle = R"(format = "diastole-study"
version = 1
[specimen]
kind = "ellipsoid"
inner_axes_mm = [21.0, 51.0]
outer_axes_mm = [30.0, 60.0]
base_z_mm = 15.0
fibre_endo_deg = 60.0
fibre_epi_deg = -60.0
mesh = [8, 4, 2]
ends = "fixed"
[law]
name = "guccione"
[law.parameters.C_kPa]
start = 1.2
bounds = [0.2, 12.0]
[data]
)";

TEST_F(StudyFile, AnEllipsoidArrives) {
  Study study = read(ventricle);
  const auto& ellipsoid = std::get<EllipsoidSpecimen>(study.specimen);
  EXPECT_THAT(ellipsoid.inner_axes_mm, testing::ElementsAre(21.0, 51.0));
  EXPECT_THAT(ellipsoid.outer_axes_mm, testing::ElementsAre(30.0, 60.0));
  EXPECT_EQ(ellipsoid.base_z_mm, 15.0);
  EXPECT_EQ(ellipsoid.fibre_endo_deg, 60.0);
  EXPECT_EQ(ellipsoid.fibre_epi_deg, -60.0);
  EXPECT_EQ(ellipsoid.ends, "fixed");
  set_mesh(study, "8,6,3");
  EXPECT_THAT(mesh_of(study.specimen), testing::ElementsAre(8, 6, 3));
}

TEST_F(StudyFile, AFittedVentricleIsAMeshFile) {
  std::string content = gel;
  const size_t kind = content.find("kind =");
  content.replace(kind, content.find("ends =") - kind, "kind = \"fitted-lv\"\nfile = \"heart.mesh.toml\"\n");
  EXPECT_EQ(std::get<MeshSpecimen>(read(content).specimen).file, folder_.path() / "heart.mesh.toml");
}

TEST_F(StudyFile, AxesOfAMirrorAreRefused) {
  const std::string content =
      std::string(ventricle) +
      "\n[images.to_specimen]\norigin_mm = [0.0, 0.0, 0.0]\nx_axis = [1.0, 0.0, 0.0]\n"
      "y_axis = [0.0, 1.0, 0.0]\nz_axis = [0.0, 0.0, -1.0]\n";
  EXPECT_THAT(message_of([&] { (void)read(content); }), AllOf(HasSubstr("z_axis"), HasSubstr("a mirror's")));
}

TEST_F(StudyFile, AnEllipsoidThatCannotBeIsRefused) {
  const auto message_when = [&](std::string_view old, std::string_view replacement) {
    std::string content = ventricle;
    content.replace(content.find(old), old.size(), replacement);
    return message_of([&] { (void)read(content); });
  };
  EXPECT_THAT(message_when("[30.0, 60.0]", "[20.0, 60.0]"),
              AllOf(HasSubstr("outer_axes_mm"), HasSubstr("20 is not beyond the inner 21")));
  EXPECT_THAT(message_when("base_z_mm = 15.0", "base_z_mm = 51.0"),
              AllOf(HasSubstr("base_z_mm"), HasSubstr("does not cut")));
  EXPECT_THAT(message_when("fibre_epi_deg", "fiber_epi_deg"), HasSubstr("fibre_epi_deg"));
  EXPECT_THAT(message_when("ellipsoid", "elipsoid"), HasSubstr("ellipsoid"));
}

}  // namespace
}  // namespace diastole
