#include "tools/diastole/refusal.hpp"

#include <vector>

#include "protocol/contract/table_reader.hpp"

namespace diastole {
namespace {

const CLI::App& chosen_command(const CLI::App& app) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty())
    command = command->get_subcommands().front();
  return *command;
}

std::string full_name(const CLI::App& command) {
  return command.get_parent() == nullptr ? command.get_name()
                                         : full_name(*command.get_parent()) + " " + command.get_name();
}

std::string expected_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  if (type.starts_with("UINT")) return "a whole number from 0 on";
  if (type.starts_with("INT")) return "a whole number";
  return type.starts_with("FLOAT") ? "a number" : type;
}

/// CLI11 says no more than "Could not convert: --frames = many".
std::string in_words(const CLI::App& command, const CLI::ConversionError& error) {
  const std::string text = error.what(), beginning = "Could not convert: ";
  const size_t equals = text.find(" = ");
  if (!text.starts_with(beginning) || equals == std::string::npos) return text;
  const CLI::Option* option =
      command.get_option_no_throw(text.substr(beginning.size(), equals - beginning.size()));
  if (option == nullptr) return text;
  return option->get_name() + ": \"" + text.substr(equals + 3) + "\" is not " + expected_of(*option);
}

/// ... than "--output is required".
std::string in_words(const CLI::App& command, const CLI::RequiredError& error) {
  const std::string text = error.what();
  const std::string name = text.substr(0, text.find(" is required"));
  if (const CLI::Option* option = command.get_option_no_throw(name); option != nullptr)
    return name + " is missing: " + option->get_description();
  if (command.get_parent() == nullptr) return "a command is missing";
  std::string names;
  for (const CLI::App* sub : command.get_subcommands({}))
    names += (names.empty() ? "" : ", ") + sub->get_name();
  return names.empty() ? text : "one of its commands is missing: " + names;
}

/// ... than "The following arguments were not expected: 4,2,1 --mehs", in reverse.
std::string in_words(const CLI::App& command, const CLI::ExtrasError& error) {
  const std::vector<std::string> extra = command.remaining();
  if (extra.empty()) return error.what();
  std::string words = "not expected:", nearest;
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames())
      names.push_back("--" + name);
  for (const std::string& word : extra) {
    words += " " + word;
    if (nearest.empty() && word.starts_with("--"))
      nearest = did_you_mean(word.substr(0, word.find('=')), names);
  }
  return nearest.empty() ? words : words + ". " + nearest.substr(0, nearest.size() - 1);
}

}  // namespace

std::string refusal(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = chosen_command(app);
  std::string words = error.what();
  if (const auto* conversion = dynamic_cast<const CLI::ConversionError*>(&error))
    words = in_words(command, *conversion);
  else if (const auto* required = dynamic_cast<const CLI::RequiredError*>(&error))
    words = in_words(command, *required);
  else if (const auto* extras = dynamic_cast<const CLI::ExtrasError*>(&error))
    words = in_words(command, *extras);
  return words + "\n  `" + full_name(command) + " --help` explains it, with examples.";
}

}  // namespace diastole
