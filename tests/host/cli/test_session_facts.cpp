// What `diastole run` asks for in a terminal.

#include "host/cli/session_facts.hpp"

#include <gmock/gmock.h>

#include <sstream>

namespace diastole {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// Answers as typed, and the questions that were put.
SessionFacts asked(SessionFacts facts, const std::string& typed, std::string* questions = nullptr) {
  std::istringstream answers(typed);
  char* text = nullptr;
  size_t size = 0;
  std::FILE* stream = ::open_memstream(&text, &size);
  ask_for(facts, answers, stream);
  std::fclose(stream);
  if (questions != nullptr) *questions = text;
  ::free(text);
  return facts;
}

TEST(SessionQuestions, AnswersAreTakenAndEmptyOnesLeaveItOpen) {
  const SessionFacts facts = asked({}, " gel-7 \nJo\n21.5\nnew hose\n");
  EXPECT_EQ(facts.specimen, "gel-7");
  EXPECT_EQ(facts.operator_name, "Jo");
  EXPECT_EQ(facts.room_temperature_C, 21.5);
  EXPECT_THAT(facts.notes, ElementsAre("new hose"));
  const SessionFacts open = asked({}, "\n\n\n\n");
  EXPECT_THAT(open.specimen, IsEmpty());
  EXPECT_EQ(open.operator_name, own_user_name());
  EXPECT_FALSE(open.room_temperature_C);
  EXPECT_THAT(open.notes, IsEmpty());
}

TEST(SessionQuestions, WhatWasGivenIsNotAskedFor) {
  std::string questions;
  const SessionFacts facts = asked({"gel-7", "Jo", 20.0, {}}, "", &questions);
  EXPECT_EQ(facts.operator_name, "Jo");
  EXPECT_EQ(questions, "note: ");
}

TEST(SessionQuestions, ATemperatureThatIsNoneIsAskedForAgain) {
  std::string questions;
  EXPECT_EQ(asked({}, "\n\nwarm\n300\n22\n", &questions).room_temperature_C, 22);
  EXPECT_THAT(questions, HasSubstr("a number from"));
  EXPECT_FALSE(asked({}, "\n\nwarm\n").room_temperature_C) << "the answers end";
}

TEST(SessionQuestions, WhatSteersATerminalIsAskedForAgain) {
  std::string questions;
  EXPECT_EQ(asked({}, "gel\x1b[D7\ngel-7\nJo\n\n\n", &questions).specimen, "gel-7");
  EXPECT_THAT(questions, HasSubstr("control character 0x1b"));
}

TEST(SessionOptions, WhatSteersATerminalOrIsNotUtf8IsRefused) {
  for (const char* option : {"--specimen", "--operator", "--note"}) {
    for (const char* text : {"red \x1b[31m", "warm\xE4"}) {
      SessionFacts facts;
      CLI::App command;
      add_facts_to(command, facts);
      EXPECT_THROW(command.parse(std::vector<std::string>{text, option}), CLI::ValidationError) << option;
    }
  }
}

TEST(SessionWords, ShowNothingThatSteersATerminal) {
  runfile::Session session;
  session.facts["specimen"] = std::string("gel \x1b[2J");
  session.notes = {{"2026-11-23T14:00:00Z", "Jo", "red \x1b[31m"}};
  EXPECT_THAT(session_words(session), testing::Not(HasSubstr("\x1b")));
  EXPECT_THAT(session_words(session), HasSubstr("by Jo: red"));
}

}  // namespace
}  // namespace diastole
