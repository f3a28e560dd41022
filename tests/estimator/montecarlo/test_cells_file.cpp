#include "estimator/montecarlo/cells_file.hpp"

#include <gmock/gmock.h>

#include "estimator/io/whole_file.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using test::message_of;
using testing::AllOf;
using testing::HasSubstr;

class Cells : public testing::Test {
 protected:
  Cells() {
    study_.file = "gel.study.toml";
    study_.law = {"neo-hookean", {{"C1_kPa", 8.71, 1.0, 15.0, Variation::whole}}};
    plan_.frames = {2};
  }
  std::filesystem::path path() const { return folder_.path() / "gel.cells.csv"; }

  test::ScratchFolder folder_;
  Study study_;
  MonteCarloPlan plan_;
  const CellResult good_{{0.8, 2, 3}, true, 4, 1.25, {8.5}, {0.1}};
  const CellResult bad_{{0.8, 2, 4}, false, 50, 2.5, {}, {}};
};

TEST_F(Cells, ComeBackAsTheyWereAppended) {
  {
    CellsFile file(path(), study_, plan_);
    file.append(good_);
    file.append(bad_);
  }
  const CellsFile again(path(), study_, plan_);
  ASSERT_EQ(again.results().size(), 2U);
  EXPECT_EQ(again.results()[0].cell, good_.cell);
  EXPECT_EQ(again.results()[0].value, good_.value);
  EXPECT_EQ(again.results()[0].se, good_.se);
  EXPECT_FALSE(again.results()[1].converged);
  EXPECT_TRUE(again.has({0.8, 2, 4}));
  EXPECT_FALSE(again.has({0.8, 2, 5}));
}

TEST_F(Cells, ARowThatWasCutOffIsFittedAgain) {
  { CellsFile(path(), study_, plan_).append(good_); }
  const std::string whole = read_whole_file(path());
  write_whole_file(path(), whole + "0.8,2,4,1,3,0.5,8.");
  {
    CellsFile file(path(), study_, plan_);
    EXPECT_EQ(file.results().size(), 1U);
    file.append(bad_);
  }
  EXPECT_EQ(CellsFile(path(), study_, plan_).results().size(), 2U);
}

TEST_F(Cells, AnotherTruthSeedOrStudyIsRefused) {
  { CellsFile(path(), study_, plan_).append(good_); }
  study_.law.parameters[0].start = 9;
  EXPECT_THAT(message_of([&] { CellsFile(path(), study_, plan_); }),
              AllOf(HasSubstr("gel.cells.csv"), HasSubstr("another study, mesh, data, seed or truth")));
  study_.law.parameters[0].start = 8.71;
  plan_.seed = 2;
  EXPECT_THAT(message_of([&] { CellsFile(path(), study_, plan_); }), HasSubstr("another study"));
}

TEST_F(Cells, AnotherMeshOrOtherDataAreRefusedToo) {
  const auto refused = [&] { return message_of([&] { CellsFile(path(), study_, plan_); }); };
  study_.specimen = AnnulusSpecimen{22.5, 50, 85, {4, 2, 1}, "fixed"};
  study_.data.tags = folder_.path() / "gel.tags.csv";
  write_whole_file(*study_.data.tags, "one\n");
  { CellsFile(path(), study_, plan_).append(good_); }
  EXPECT_EQ(refused(), "(no error)");
  std::get<AnnulusSpecimen>(study_.specimen).mesh = {3, 2, 1};
  EXPECT_THAT(refused(), HasSubstr("another study, mesh"));
  std::get<AnnulusSpecimen>(study_.specimen).mesh = {4, 2, 1};
  study_.law.parameters[0].smoothness = {Smoothness::Kind::given, 0.1};
  EXPECT_THAT(refused(), HasSubstr("another study, mesh"));
  study_.law.parameters[0].smoothness = {};
  write_whole_file(*study_.data.tags, "two\n");
  EXPECT_THAT(refused(), HasSubstr("another study, mesh"));
}

TEST_F(Cells, AnEmptyFileIsBegun) {
  write_whole_file(path(), "");
  { CellsFile(path(), study_, plan_).append(good_); }
  EXPECT_EQ(CellsFile(path(), study_, plan_).results().size(), 1U);
}

TEST_F(Cells, ARowThatIsNoneIsToldWithItsLine) {
  { CellsFile(path(), study_, plan_).append(good_); }
  const std::string whole = read_whole_file(path());
  write_whole_file(path(), whole + "0.8,2,x,1,3,0.5,8.1,0.1\n");
  EXPECT_THAT(message_of([&] { CellsFile(path(), study_, plan_); }),
              AllOf(HasSubstr("line 4"), HasSubstr("\"x\"")));
  write_whole_file(path(), whole + "0.8,2\n");
  EXPECT_THAT(message_of([&] { CellsFile(path(), study_, plan_); }), HasSubstr("columns"));
}

}  // namespace
}  // namespace diastole
