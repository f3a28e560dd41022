#include <gmock/gmock.h>

#include <fstream>

#include "estimator/explain/verdict/learned_file.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole::explain {
namespace {

namespace fs = std::filesystem;

class LearnedFile : public testing::Test {
 protected:
  void SetUp() override { write_learned_file(path_, "id = \"learned\"\n"); }
  void add(const std::string& text) const { std::ofstream(path_, std::ios::app) << text; }

  test::ScratchFolder folder_;
  fs::path path_ = folder_.path() / "learned.effect.toml";
};

TEST_F(LearnedFile, IsReplacedAndRemovedWhileNobodyTouchedIt) {
  EXPECT_NO_THROW(require_learned_file(path_, {}, false));
  EXPECT_THAT(read_whole_file(path_), testing::EndsWith("\nid = \"learned\"\n"));
  remove_learned_file(path_);
  EXPECT_FALSE(fs::exists(path_));
  EXPECT_NO_THROW(remove_learned_file(path_));
}

TEST_F(LearnedFile, IsKeptOnceSomebodyChangedIt) {
  add("title = \"our coupling\"\n");
  EXPECT_THROW(require_learned_file(path_, {}, false), InputError);
  EXPECT_NO_THROW(require_learned_file(path_, {}, true));
  remove_learned_file(path_);
  EXPECT_TRUE(fs::exists(path_));
}

TEST_F(LearnedFile, IsNotRemovedWhereAnotherFileHasItsName) {
  write_whole_file(path_, "id = \"mine\"\n");
  EXPECT_THROW(require_learned_file(path_, {}, false), InputError);
  EXPECT_NO_THROW(require_learned_file(path_, {}, true));
  remove_learned_file(path_);
  EXPECT_TRUE(fs::exists(path_));
}

TEST_F(LearnedFile, HasTheNameOfItsEffect) {
  EXPECT_EQ(learned_id(0), "learned");
  EXPECT_EQ(learned_file_name(0), "learned.effect.toml");
  EXPECT_EQ(learned_file_name(1), "learned-2.effect.toml");
}

TEST_F(LearnedFile, IsNeverAnInput) { EXPECT_THROW(require_learned_file(path_, {path_}, true), InputError); }

}  // namespace
}  // namespace diastole::explain
