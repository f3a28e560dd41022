// Which studies can have their images explained.

#include <gmock/gmock.h>

#include "estimator/explain/imaging/field_fit.hpp"
#include "estimator/model/specimen_family.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole::explain {
namespace {

Study imaged_gel() {
  Study study;
  study.file = "gel.study.toml";
  study.specimen = AnnulusSpecimen{22.5, 50.0, 85.0, {8, 4, 1}, "fixed"};
  study.law = {"neo-hookean", {{"C1_kPa", 6.0, 1.0, 15.0, Variation::whole}}};
  study.data.tags = "not-there.tags.csv";
  study.data.frames = "not-there.frames.csv";
  return study;
}

std::string refusal_of(const Study& study) {
  return test::message_of([&] { (void)field_case(study); });
}

TEST(FieldCase, OneStiffnessAnElementIsRefusedWithARemedy) {
  Study study = imaged_gel();
  study.law.parameters[0].vary = Variation::element;
  EXPECT_THAT(refusal_of(study), testing::HasSubstr("law.parameters.C1_kPa.vary"));
  EXPECT_THAT(refusal_of(study), testing::HasSubstr("vary = \"whole\""));
}

TEST(FieldCase, AShapeThatWasImagedUnderLoadIsRefusedForImagesAndRuns) {
  Study study = imaged_gel();
  study.imaged_at = ImagedLoad{1.0, 0.05};
  for (const std::string& refusal :
       {refusal_of(study), test::message_of([&] { (void)rig::SpecimenFamily(study); })}) {
    EXPECT_THAT(refusal, testing::HasSubstr("specimen.imaged_at_kPa"));
    EXPECT_THAT(refusal, testing::HasSubstr("mesh export"));
  }
}

TEST(FieldCase, OnlyThenTheImagesAreRead) {
  EXPECT_THAT(refusal_of(imaged_gel()), testing::HasSubstr("not-there"));
}

}  // namespace
}  // namespace diastole::explain
