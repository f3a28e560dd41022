#include "host/cli/session_facts.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pwd.h>
#include <unistd.h>

#include <optional>
#include <vector>

#include "protocol/contract/command.hpp"
#include "protocol/contract/named_members.hpp"
#include "protocol/contract/plain_text.hpp"
#include "protocol/contract/text.hpp"
#include "protocol/runfile/layout.hpp"

namespace diastole {
namespace {

/// Of rooms in which people work.
constexpr double coldest_C = -10, warmest_C = 60;

/// None if nobody answers any more; asks again for what is not plain.
std::optional<std::string> answer_to(const std::string& question, std::istream& answers,
                                     std::FILE* questions) {
  for (std::string answer;;) {
    fmt::print(questions, "{}: ", question);
    std::fflush(questions);
    if (!std::getline(answers, answer)) return std::nullopt;
    const std::string why = why_not_plain(trimmed(answer));
    if (why.empty()) return std::string(trimmed(answer));
    fmt::print(questions, "  it {}\n", why);
  }
}

void ask_for_temperature(std::optional<double>& temperature_C, std::istream& answers, std::FILE* questions) {
  while (!temperature_C) {
    const auto answer = answer_to("room temperature (C)", answers, questions);
    if (!answer || answer->empty()) return;
    const auto value_C = parse_number<double>(*answer);
    if (value_C && *value_C >= coldest_C && *value_C <= warmest_C) {
      temperature_C = value_C;
    } else {
      fmt::print(questions, "  a number from {} to {}, as 21.5; or Enter\n", coldest_C, warmest_C);
    }
  }
}

}  // namespace

void add_facts_to(CLI::App& command, SessionFacts& facts) {
  constexpr auto plain = [](const std::string& text) { return why_not_plain(text); };
  command.add_option("--specimen", facts.specimen, "name of the specimen, kept in the run file")
      ->check(plain, "");
  command.add_option("--operator", facts.operator_name, "who does the session")->check(plain, "");
  command.add_option("--room-temperature-C", facts.room_temperature_C, "temperature of the room")
      ->check(number_between(coldest_C, warmest_C));
  command.add_option("--note", facts.notes, "a remark; may be repeated, and `diastole note` adds more later")
      ->check(plain, "");
}

std::string own_user_name() {
  const passwd* user = ::getpwuid(::geteuid());
  return user == nullptr ? fmt::format("user {}", ::geteuid()) : user->pw_name;
}

void ask_for(SessionFacts& facts, std::istream& answers, std::FILE* questions) {
  if (facts.specimen.empty()) facts.specimen = answer_to("specimen", answers, questions).value_or("");
  if (facts.operator_name.empty()) {
    const std::string user = own_user_name();
    facts.operator_name = answer_to(fmt::format("operator [{}]", user), answers, questions).value_or("");
    if (facts.operator_name.empty()) facts.operator_name = user;
  }
  ask_for_temperature(facts.room_temperature_C, answers, questions);
  if (facts.notes.empty()) {
    const std::string note = answer_to("note", answers, questions).value_or("");
    if (!note.empty()) facts.notes.push_back(note);
  }
}

nlohmann::json session_json(const runfile::Session& session) {
  nlohmann::json object{{runfile::specimen_fact, nullptr},
                        {runfile::operator_fact, nullptr},
                        {runfile::room_temperature_fact, nullptr}};
  for (const auto& [name, value] : session.facts)
    std::visit([&, key = name](const auto& v) { object[key] = v; }, value);
  object["notes"] = nlohmann::json::array();
  for (const runfile::SessionNote& note : session.notes)
    object["notes"].push_back({DIASTOLE_NAMED(note, written_utc, author, text)});
  return object;
}

std::string session_words(const runfile::Session& session) {
  std::vector<std::string> facts;
  for (const auto& [name, value] : session.facts)
    std::visit([&, key = name](const auto& v) { facts.push_back(fmt::format("{} {}", key, v)); }, value);
  std::string words = facts.empty() ? "" : fmt::format("  {}\n", fmt::join(facts, ", "));
  for (const runfile::SessionNote& note : session.notes)
    words += fmt::format("  note of {}{}{}: {}\n", note.written_utc, note.author.empty() ? "" : " by ",
                         note.author, note.text);
  return made_plain(words);
}

}  // namespace diastole
