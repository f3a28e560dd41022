// What a session's files say of the rig is held against what can be.

#include <gmock/gmock.h>
#include <hdf5.h>

#include "estimator/model/session.hpp"
#include "estimator/rig_fit/simulated_session.hpp"
#include "protocol/runfile/amended_file.hpp"
#include "tests/changed_run.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tests/recorded_data.hpp"

namespace diastole::rig {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

TEST(Session, IsRefusedWhereTheRigCannotBe) {
  const test::ScratchFolder folder;
  fs::copy(test::recorded("rig/case-028"), folder.path(), fs::copy_options::recursive);
  const Study study = read_study(folder.path() / "case-028.study.toml");
  fs::permissions(study.data.runs.front(), fs::perms::owner_write, fs::perm_options::add);
  const auto refusal = [&] { return test::message_of([&] { (void)read_session(study); }); };
  EXPECT_EQ(refusal(), "(no error)");
  runfile::amend_run(study.data.runs.front(), "/rig", [](hid_t file) {
    const double length_m = -5.0;
    const hid_t rig = H5Gopen2(file, "/rig", H5P_DEFAULT);
    const hid_t attribute = H5Aopen(rig, "hose_length_m", H5P_DEFAULT);
    const bool written = H5Awrite(attribute, H5T_NATIVE_DOUBLE, &length_m) >= 0;
    H5Aclose(attribute);
    H5Gclose(rig);
    return written;
  });
  EXPECT_THAT(refusal(), HasSubstr("attribute /rig hose_length_m"));
}

TEST(Session, KnowsHowFarASmoothedMotionIsFromTheSteps) {
  const test::ScratchFolder folder;
  fs::copy(test::recorded("rig/case-030"), folder.path(), fs::copy_options::recursive);
  const Study study = read_study(folder.path() / "case-030.study.toml");
  EXPECT_EQ(read_session(study).runs.at(0).smoothed_mL, 0.0);
  test::wobble_steps(study.data.runs.front());
  const double smoothed_mL = read_session(study).runs.at(0).smoothed_mL;
  EXPECT_GT(smoothed_mL, 0.05);
  EXPECT_LT(smoothed_mL, 0.3);
}

/// Neither its name nor bounds that hold no 1 kPa matter.
TEST(SpecimenFamily, FindsTheModulusOfALawFileByItsUnit) {
  const test::ScratchFolder folder;
  Study study = gel_study();
  study.law = {"gel.law.toml",
               {{"b", 0.0, -0.5, 5.0, Variation::whole}, {"c1", 6.0, 3.0, 15.0, Variation::whole}},
               folder.write("gel.law.toml", R"toml(
format = "diastole-law"
version = 1
id = "my-gel"
energy_kPa = "c1 * (I1 - 3) * exp(b * (I1 - 3))"
[[parameter]]
name = "b"
bounds = [-1, 10]
typical = 1
[[parameter]]
name = "c1"
unit = "kPa"
bounds = [2, 20]
typical = 8
)toml")};
  const SpecimenFamily family(study, {{4, 2, 1}, {4, 2, 1}, 16.0, 3, 1, 1});
  EXPECT_EQ(family.modulus().name, "c1");
  EXPECT_EQ(family.modulus_start_kPa(), 6.0);
  const SpecimenFamily built_in = gel_family();
  for (const double volume_mL : {-16.0, 16.0, 48.0})
    EXPECT_NEAR(family.plain().at(volume_mL).pressure_kPa / built_in.plain().at(volume_mL).pressure_kPa, 1.0,
                1e-6);
  constexpr double full_mL = 48.0, beyond_kPa = 1e3;
  EXPECT_NEAR(family.reach(full_mL, beyond_kPa).pressure_kPa, 6.0 * family.plain().at(full_mL).pressure_kPa,
              1e-3);
}

}  // namespace
}  // namespace diastole::rig
