#include <gmock/gmock.h>

#include "estimator/explain/verdict/explained_study.hpp"
#include "tests/estimator/io/gel_study.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole::explain {
namespace {

using testing::ElementsAre;

const std::string gel =
    std::string(test::gel_study) + "runs = [\"baseline.run.h5\"]\n[model]\neffects = []\n";

TEST(ExplainedStudy, IsReadBackWithWhatWasFound) {
  test::ScratchFolder folder;
  const Study study = read_study(folder.write("gel.study.toml", gel));
  const std::vector<FoundEffect> effects{
      {"hose-compliance", {{"wave_speed_m_s", 46.5, 0.1, {46.3, 46.7}}}, {}},
      {"sensor-offset", {{"step_Pa", 310.0, 2.0, {307.0, 313.0}}}, {{"baseline", 12.25}}}};
  const auto out = study.file.parent_path() / "out";
  std::filesystem::create_directories(out);
  const auto file = folder.write("out/explained.study.toml",
                                 explained_study(study, out, effects, {{"C1_kPa", 6.0, 0.1, 7.25, 0.1}}));
  const Study again = read_study(file);
  EXPECT_THAT(again.effects, ElementsAre("hose-compliance", "sensor-offset"));
  ASSERT_EQ(again.effect_values.size(), 2U);
  EXPECT_EQ(again.effect_values[0].starts.at("wave_speed_m_s"), 46.5);
  EXPECT_EQ(again.effect_values[1].moments.at(0).run, "baseline");
  EXPECT_EQ(again.effect_values[1].moments.at(0).time_s, 12.25);
  EXPECT_EQ(again.law.parameters.at(0).start, 7.25);
  EXPECT_EQ(std::filesystem::weakly_canonical(again.data.runs.at(0)),
            std::filesystem::weakly_canonical(study.data.runs.at(0)));
}

TEST(ExplainedStudy, KeepsAValueBeyondTheStudysBounds) {
  test::ScratchFolder folder;
  const Study study = read_study(folder.write("gel.study.toml", gel));
  const auto out = study.file.parent_path() / "out";
  std::filesystem::create_directories(out);
  const double beyond = 3.0 * study.law.parameters.at(0).upper;
  const Study again = read_study(folder.write(
      "out/explained.study.toml", explained_study(study, out, {}, {{"C1_kPa", 6.0, 0.1, beyond, 0.1}})));
  EXPECT_EQ(again.law.parameters.at(0).start, beyond);
  EXPECT_EQ(again.law.parameters.at(0).upper, beyond);
  EXPECT_EQ(again.law.parameters.at(0).lower, study.law.parameters.at(0).lower);
}

TEST(ExplainedStudy, CarriesTheUsersFiles) {
  test::ScratchFolder folder;
  Study study = read_study(folder.write("gel.study.toml", gel + "effect_files = [\"mine.effect.toml\"]\n"));
  const auto& root = study.file.parent_path();
  study.effect_files.push_back(root / "with" / "other.effect.toml");  // as by explain --with
  const auto out = root / "out";
  std::filesystem::create_directories(out);
  const Study again = read_study(folder.write("out/explained.study.toml",
                                              explained_study(study, out, {{"mine", {{"G", 0.1}}, {}}}, {})));
  ASSERT_EQ(again.effect_files.size(), 2U);
  for (size_t i = 0; i < 2; ++i)
    EXPECT_EQ(std::filesystem::weakly_canonical(again.effect_files[i]),
              std::filesystem::weakly_canonical(study.effect_files[i]));
  EXPECT_THAT(again.effects, ElementsAre("mine"));
}

TEST(ExplainedStudy, CarriesTheSpecimensFiles) {
  test::ScratchFolder folder;
  const Study study = read_study(folder.write("heart.study.toml", R"(format = "diastole-study"
version = 1
[specimen]
kind = "mesh"
mesh_file = "heart.mesh.toml"
fibres = "heart.fibres.csv"
ends = "fixed"
[law]
name = "guccione"
parameters.C_kPa = { start = 1.0, bounds = [0.1, 10.0] }
[data]
images = "dicom"
frames = "heart.frames.csv"
)"));
  const auto out = study.file.parent_path() / "out";
  std::filesystem::create_directories(out);
  const Study again = read_study(
      folder.write("out/explained.study.toml", explained_study(study, out, {{"fibre-turn", {}, {}}}, {})));
  const auto same = [](const std::filesystem::path& a, const std::filesystem::path& b) {
    return std::filesystem::weakly_canonical(a) == std::filesystem::weakly_canonical(b);
  };
  EXPECT_TRUE(same(std::get<MeshSpecimen>(again.specimen).file, std::get<MeshSpecimen>(study.specimen).file));
  EXPECT_TRUE(same(*again.fibres, *study.fibres));
  EXPECT_TRUE(same(*again.data.images, *study.data.images));
}

TEST(ExplainedStudy, ATableOfAnEffectThatIsNotListedIsRefused) {
  test::ScratchFolder folder;
  const std::string stray = gel + "[model.parameters.hose-compliance.wave_speed_m_s]\nstart = 46.0\n";
  const std::string message =
      test::message_of([&] { (void)read_study(folder.write("stray.study.toml", stray)); });
  EXPECT_THAT(message, testing::HasSubstr("model.parameters.hose-compliance"));
}

}  // namespace
}  // namespace diastole::explain
