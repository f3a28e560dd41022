#pragma once
// How a subcommand joins the front door. Each folder with commands (host/cli, estimator/cli, tools/...)
// offers one function `void add_..._commands(CommandLine&)`; each command is one file with a function of the
// same form:
//
//   void add_inspect(CommandLine& line) {
//     auto options = std::make_shared<InspectOptions>();
//     CLI::App* command = line.add("inspect", "what is in a run file, and whether it is sound",
//                                  "  diastole inspect session.run.h5\n  diastole inspect session.run.h5
//                                  --json");
//     command->add_option("RUN", options->run, "run file")->required();
//     line.on_run(command, [options](const CommandOutput& out) { ...; return ExitCode::done; });
//   }
//
// With --json (every command has it) `out.json` is true: print exactly one JSON document on standard output,
// and everything meant for a person on standard error.

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <iomanip>
#include <optional>
#include <sstream>
#include <string>

#include "protocol/contract/exit_code.hpp"

namespace diastole {

struct CommandOutput {
  bool json = false;
};

/// The number that a text is, none if it is more or less than one.
inline std::optional<double> number_of(const std::string& text) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  return text.empty() || *end != '\0' ? std::nullopt : std::optional(number);
}

/// For options, instead of CLI11's, which report the largest number that there is, or six decimals. What is no number is refused when it is converted.
inline const CLI::Validator positive_number(
    [](const std::string& text) {
      return number_of(text).value_or(1.0) <= 0.0 ? text + " is not above zero" : "";
    },
    "POSITIVE");
inline const CLI::Validator nonnegative_number(
    [](const std::string& text) {
      return number_of(text).value_or(0.0) < 0.0 ? text + " is below zero" : "";
    },
    "NONNEGATIVE");
/// Both included.
template <class Number>
CLI::Validator number_between(Number low, Number high) {
  std::ostringstream range;
  range << std::setprecision(15) << low << " to " << high;
  return {[low, high, range = range.str()](const std::string& text) {
            const double number = number_of(text).value_or(static_cast<double>(low));
            const bool is_between = number >= static_cast<double>(low) && number <= static_cast<double>(high);
            return is_between ? "" : text + " is not from " + range;
          },
          range.str()};
}

class CommandLine {
 public:
  using Action = std::function<ExitCode(const CommandOutput&)>;

  explicit CommandLine(CLI::App& app) : app_(app) {}

  /// Adds a subcommand whose help ends in worked examples, and its --json flag.
  CLI::App* add(const std::string& name, const std::string& purpose, const std::string& examples) {
    CLI::App* command = app_.add_subcommand(name, purpose);
    command->footer("Examples:\n" + examples);
    command->add_flag("--json", output_.json, "print one JSON document on standard output");
    return command;
  }

  /// What the front door runs when `command` was chosen, which has all its options by now. Its numbers must be finite, its words some, and none of them
  /// the name of another option, before which a word was forgotten.
  void on_run(CLI::App* command, Action action) {
    for (CLI::Option* option : command->get_options()) {
      if (option->get_type_name().starts_with("FLOAT")) option->check(must_be_finite, "");
      if (option->get_type_name().starts_with("TEXT"))
        option->check([command](const std::string& text) { return must_be_some(*command, text); }, "");
    }
    command->callback([this, action = std::move(action)] { chosen_ = action; });
  }

  [[nodiscard]] ExitCode run() const { return chosen_ ? chosen_(output_) : ExitCode::bad_input; }

 private:
  static std::string must_be_finite(const std::string& text) {
    return std::isfinite(number_of(text).value_or(0.0)) ? "" : text + " is not a finite number";
  }
  static std::string must_be_some(const CLI::App& command, const std::string& text) {
    if (text.empty()) return "is empty";
    const bool is_option = text.size() > 1 && text[0] == '-' && command.get_option_no_throw(text) != nullptr;
    return is_option ? "has no value before " + text : "";
  }
  CLI::App& app_;
  CommandOutput output_;
  Action chosen_;
};

}  // namespace diastole
