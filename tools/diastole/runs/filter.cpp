#include "tools/diastole/runs/filter.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <regex>
#include <string_view>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"
#include "protocol/contract/text.hpp"

namespace diastole::catalogue {
namespace {

enum class Form { text, contained, number, yes_or_no, date };

struct Key {
  std::string_view name;
  Form form;
};

constexpr std::array known{Key{"path", Form::contained},
                           Key{"kind", Form::text},
                           Key{"date", Form::date},
                           Key{"specimen", Form::text},
                           Key{"operator", Form::text},
                           Key{"room_temperature_C", Form::number},
                           Key{"protocol", Form::contained},
                           Key{"duration_s", Form::number},
                           Key{"cycles", Form::number},
                           Key{"peak_kPa", Form::number},
                           Key{"sound", Form::yes_or_no},
                           Key{"problem", Form::contained},
                           Key{"verdict", Form::text},
                           Key{"effects", Form::contained},
                           Key{"parameter", Form::text},
                           Key{"stiffness_kPa", Form::number},
                           Key{"stiffness_se_kPa", Form::number},
                           Key{"notes", Form::contained}};

/// Other names that come to mind.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> also{
    {{"effect", "effects"},
     {"note", "notes"},
     {"stiffness", "stiffness_kPa"},
     {"temperature", "room_temperature_C"}}};

struct Word {
  std::string key;  ///< empty: a word alone
  std::string sign;
  std::string value;
  std::string whole;
};

Word parsed(const std::string& word) {
  static constexpr std::array<std::string_view, 6> signs{"<=", ">=", "!=", "=", "<", ">"};
  const size_t at = word.find_first_of("<>=!");
  if (at == std::string::npos || at == 0) return {"", "", word, word};
  for (const std::string_view sign : signs) {
    if (word.compare(at, sign.size(), sign) == 0)
      return {word.substr(0, at), std::string(sign), word.substr(at + sign.size()), word};
  }
  return {"", "", word, word};
}

[[noreturn]] void refuse(const Word& word, const std::string& problem, const std::string& remedy) {
  throw InputError({"", fmt::format("filter {}", word.whole), problem, remedy});
}

/// For LIKE with `escape '\'`.
std::string pattern(const std::string& text, bool contained) {
  std::string out = contained ? "%" : "";
  for (const char c : text) {
    if (c == '%' || c == '_' || c == '\\') out += '\\';
    out += c == '*' ? '%' : c;
  }
  return contained ? out + "%" : out;
}

void add_text(const Word& word, std::string_view column, bool contained, Condition& condition) {
  if (word.sign != "=" && word.sign != "!=")
    refuse(word, fmt::format("{} is a text", column), "Compare it with = or !=.");
  condition.sql += fmt::format(R"( and "{}" {}like ? escape '\')", column, word.sign == "!=" ? "not " : "");
  condition.values.emplace_back(pattern(word.value, contained));
}

void add_number(const Word& word, std::string_view column, Condition& condition) {
  const auto value = parse_number<double>(word.value);
  if (!value) refuse(word, fmt::format("\"{}\" is no number", word.value), fmt::format("As {}<9.5.", column));
  condition.sql += fmt::format(R"( and "{}" {} ?)", column, word.sign);
  condition.values.emplace_back(*value);
}

void add_yes_or_no(const Word& word, std::string_view column, Condition& condition) {
  if (word.sign != "=" || (word.value != "yes" && word.value != "no"))
    refuse(word, fmt::format("\"{}\" is neither yes nor no", word.value),
           fmt::format("{}=yes or {}=no.", column, column));
  condition.sql += fmt::format(R"( and "{}" = {})", column, word.value == "yes" ? 1 : 0);
}

/// As 2026, 2026-11, 2026-11-23, ...T14, ...:05, ...:59, with Z or without.
bool is_date_or_its_start(const std::string& text) {
  static const std::regex form(
      R"(\d{4}(-(0[1-9]|1[0-2])(-(0[1-9]|[12]\d|3[01])(T([01]\d|2[0-3])(:[0-5]\d(:[0-5]\d(\.\d+)?)?)?Z?)?)?)?)");
  return std::regex_match(text, form);
}

/// A date may be short: since=2026-11 begins with November, until=2026-11 ends with it.
void add_date(const Word& word, std::string_view sign, Condition& condition) {
  if (!is_date_or_its_start(word.value))
    refuse(word, fmt::format("\"{}\" is no date", word.value),
           "Write it as 2026, 2026-11, 2026-11-23 or 2026-11-23T14:00.");
  condition.sql += fmt::format(" and substr(date, 1, {}) {} ?", word.value.size(), sign);
  condition.values.emplace_back(word.value);
}

void add_anywhere(const Word& word, Condition& condition) {
  condition.sql += " and (";
  bool first = true;
  for (const Key& key : known) {
    if (key.form != Form::text && key.form != Form::contained) continue;
    condition.sql += fmt::format(R"({}"{}" like ? escape '\')", first ? "" : " or ", key.name);
    condition.values.emplace_back(pattern(word.value, true));
    first = false;
  }
  condition.sql += ")";
}

void add(const Word& word, Condition& condition) {
  if (word.key.empty()) return add_anywhere(word, condition);
  if (word.key == "since" || word.key == "until") {
    if (word.sign != "=") refuse(word, "takes no other sign than =", fmt::format("{}=2026-11", word.key));
    return add_date(word, word.key == "since" ? ">=" : "<=", condition);
  }
  std::string_view name = word.key;
  for (const auto& [other, own] : also)
    if (name == other) name = own;
  const auto* key = std::ranges::find(known, name, &Key::name);
  if (key == known.end()) {
    std::vector<std::string> names = keys();
    names.insert(names.end(), {"since", "until"});
    refuse(word, fmt::format("there is no key \"{}\"", word.key),
           fmt::format("{}Known are {}.", did_you_mean(word.key, names), fmt::join(names, ", ")));
  }
  switch (key->form) {
    case Form::text:
      return add_text(word, key->name, false, condition);
    case Form::contained:
      return add_text(word, key->name, true, condition);
    case Form::number:
      return add_number(word, key->name, condition);
    case Form::yes_or_no:
      return add_yes_or_no(word, key->name, condition);
    case Form::date:
      return add_date(word, word.sign, condition);
  }
}

}  // namespace

Condition condition_of(const std::vector<std::string>& words) {
  Condition condition{"1", {}};
  for (const std::string& word : words)
    add(parsed(word), condition);
  return condition;
}

bool is_word_alone(const std::string& word) { return parsed(word).key.empty(); }

const std::vector<std::string>& keys() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const Key& key : known)
      all.emplace_back(key.name);
    return all;
  }();
  return names;
}

}  // namespace diastole::catalogue
