// What was learnt from a session's own runs is not found in it, and elsewhere only beside what predicted as well.

#include "estimator/explain/rig/learnt_effects.hpp"

#include <gmock/gmock.h>

#include "estimator/explain/rig/port_law.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole::explain {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

std::shared_ptr<const Effect> learnt(const std::string& id, const std::vector<std::string>& looks_alike) {
  const std::vector<double> at{0.0, 20.0, 40.0}, values{0.0, 0.1, 4.5};
  return effect_of_text(tabulated_law(port_laws().front(), at, values,
                                      {.id = id, .learnt_from = {"a", "b"}, .looks_alike = looks_alike}));
}

class LearntEffects : public testing::Test {
 protected:
  static rig::Session session_of(const std::vector<std::string>& run_ids) {
    rig::Session session;
    for (const std::string& id : run_ids) {
      rig::SessionRun& run = session.runs.emplace_back();
      run.run_id = id;
      run.drive.place.name = "run-" + id;
    }
    return session;
  }
  const std::shared_ptr<const Effect> best_ = learnt("learned", {"learned-2"});
  const std::shared_ptr<const Effect> rival_ = learnt("learned-2", {"learned"});
};

TEST_F(LearntEffects, AreNotLookedForInARunThatTheyWereLearntFrom) {
  rig::Session session = session_of({"b", "c"});
  session.effects.add(best_);
  EXPECT_THAT(set_aside_learnt({}, session),
              AllOf(HasSubstr("learned was learnt from run-b itself"), Not(HasSubstr("run-c"))));
  EXPECT_THAT(session.effects.of_rig(), Not(Contains(best_.get())));
  EXPECT_EQ(session.effects.find("learned"), best_.get());  // a study's model may hold it
}

TEST_F(LearntEffects, CompeteInNewRunsWithWhatPredictedAsWell) {
  rig::Session session = session_of({"c", "d"});
  session.effects.add(best_);
  EXPECT_THAT(test::message_of([&] { set_aside_learnt({}, session); }),
              AllOf(HasSubstr("key model.effect_files"), HasSubstr("learned-2")));
  session.effects.add(rival_);
  EXPECT_THAT(set_aside_learnt({}, session), IsEmpty());
  EXPECT_THAT(session.effects.of_rig(), AllOf(Contains(best_.get()), Contains(rival_.get())));
}

}  // namespace
}  // namespace diastole::explain
