#include "protocol/contract/table_reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numeric>

#include "protocol/contract/bounded_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

namespace diastole {
namespace {

size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row[b.size()];
}

/// The key that was probably meant to be `wanted`: one that nobody asked for and that differs by its case and
/// a letter or two (one in a short word). Three would take outer_radius_mm for inner_radius_mm.
const toml::key* misspelt(std::string_view wanted, const toml::table& table,
                          const std::set<std::string, std::less<>>& asked) {
  constexpr size_t short_word = 5;
  const toml::key* nearest = nullptr;
  size_t limit = wanted.size() <= short_word ? 1 : 2;
  for (const auto& [key, node] : table) {
    if (asked.contains(key.str())) continue;
    const size_t distance = edit_distance(in_small_letters(wanted), in_small_letters(key.str()));
    if (distance > limit || (nearest != nullptr && distance == limit)) continue;
    limit = distance;
    nearest = &key;
  }
  return nearest;
}

/// "greater than 0 and at most 15", for messages.
std::string describe(const NumberRange& range) {
  std::vector<std::string> parts;
  if (std::isfinite(range.above)) parts.push_back(fmt::format("greater than {}", range.above));
  if (std::isfinite(range.at_least)) parts.push_back(fmt::format("at least {}", range.at_least));
  if (std::isfinite(range.below)) parts.push_back(fmt::format("less than {}", range.below));
  if (std::isfinite(range.at_most)) parts.push_back(fmt::format("at most {}", range.at_most));
  return parts.empty() ? "a finite number" : fmt::format("{}", fmt::join(parts, " and "));
}

bool within(double value, const NumberRange& range) {
  return std::isfinite(value) && value > range.above && value < range.below && value >= range.at_least &&
         value <= range.at_most;
}

}  // namespace

std::string PlacedText::place(size_t offset) const {
  size_t at_line = line;
  size_t at_column = column;
  for (const char c : std::string_view(text).substr(0, offset)) {
    if (begins_character(c)) at_column = c == '\n' ? 1 : at_column + 1;
    at_line += c == '\n' ? 1 : 0;
  }
  return fmt::format("line {}, column {}, key {}", at_line, at_column, key);
}

std::string did_you_mean(std::string_view word, const std::vector<std::string>& known) {
  const std::string* nearest = nullptr;
  size_t least = word.size() / 2 + 1;
  for (const std::string& candidate : known) {
    const bool begun = !word.empty() && candidate.starts_with(word);
    const size_t distance = begun ? 0 : edit_distance(word, candidate);
    if (distance >= least) continue;
    least = distance;
    nearest = &candidate;
  }
  return nearest == nullptr ? std::string{} : fmt::format("Did you mean \"{}\"? ", *nearest);
}

TableReader::TableReader(std::shared_ptr<const toml::table> document, const toml::table* table,
                         std::string file, std::string path)
    : document_(std::move(document)), table_(table), file_(std::move(file)), path_(std::move(path)) {}

TableReader TableReader::from_file(const std::filesystem::path& path) {
  return from_text(read_bounded_file(path, most_settings_bytes), path.string());
}

TableReader TableReader::from_text(std::string_view text, std::string name) {
  if (is_hdf5(text)) {
    throw InputError(
        {std::move(name), "", "is an HDF5 file such as a run file, but a TOML file is expected here",
         "Give the TOML file that belongs here; a study (NAME.study.toml) names its run files under "
         "[data] runs."});
  }
  if (text.starts_with("{")) {
    throw InputError({std::move(name), "", "is JSON, but a TOML file is expected here",
                      "Give the TOML file that belongs here, such as a study (NAME.study.toml)."});
  }
  try {
    auto document = std::make_shared<toml::table>(toml::parse(text));
    const toml::table* root = document.get();
    return {std::move(document), root, std::move(name), ""};
  } catch (const toml::parse_error& error) {
    const auto& at = error.source().begin;
    throw InputError({std::move(name), fmt::format("line {}, column {}", at.line, at.column),
                      fmt::format("is not TOML: {}", error.description()),
                      "Correct the syntax at this place; strings need quotes, tables need [brackets]."});
  }
}

int64_t TableReader::expect_format(std::string_view name, int64_t newest) {
  if (const std::string found = text("format"); found != name) {
    fail("format", fmt::format("is \"{}\", but \"{}\" is expected here", found, name),
         "Give the right kind of file to this command.");
  }
  const int64_t version = integer("version", {.at_least = 1});
  if (version > newest) {
    fail("version", fmt::format("is {}, newer than the {} that this program reads", version, newest),
         "Update Diastole.");
  }
  return version;
}

bool TableReader::has(std::string_view key) { return find(key) != nullptr; }

bool TableReader::has_text(std::string_view key) { return has(key) && table_->get(key)->is_string(); }

double TableReader::number(std::string_view key, NumberRange range) {
  return checked_number(key, need(key, "a number"), range);
}

double TableReader::number_or(std::string_view key, double fallback, NumberRange range) {
  return has(key) ? number(key, range) : fallback;
}

int64_t TableReader::integer(std::string_view key, NumberRange range) {
  return checked_integer(key, need(key, "a whole number"), range);
}

int64_t TableReader::integer_or(std::string_view key, int64_t fallback, NumberRange range) {
  return has(key) ? integer(key, range) : fallback;
}

std::string TableReader::text(std::string_view key) {
  const auto value = need(key, "a text in quotes").value_exact<std::string>();
  if (!value) fail(key, "is not a text", fmt::format("Write {} = \"...\".", key));
  return *value;
}

std::string TableReader::text_or(std::string_view key, std::string fallback) {
  return has(key) ? text(key) : std::move(fallback);
}

PlacedText TableReader::placed_text(std::string_view key) {
  PlacedText placed{.text = text(key), .file = file_, .key = dotted(key)};
  const toml::source_region& source = table_->get(key)->source();
  const auto breaks = static_cast<size_t>(std::ranges::count(placed.text, '\n'));
  const size_t lines = source.end.line - source.begin.line;
  const size_t width = source.end.column - source.begin.column;
  // Three quotes stand before a text that is longer by four than with one; a line break behind them is none of its own.
  const bool in_three = lines > 0 || width >= characters_of(placed.text) + 6;
  placed.line = source.begin.line + (lines > breaks ? 1 : 0);
  placed.column = lines > breaks ? 1 : source.begin.column + (in_three ? 3 : 1);
  return placed;
}

std::vector<std::pair<std::string, PlacedText>> TableReader::named_texts() {
  std::vector<std::pair<std::string, PlacedText>> texts;
  for (const auto& [key, node] : *table_)
    texts.emplace_back(key.str(), placed_text(key.str()));
  std::ranges::sort(texts, {}, [](const auto& one) { return std::pair(one.second.line, one.second.column); });
  return texts;
}

std::string TableReader::choice(std::string_view key, const std::vector<std::string>& allowed) {
  const std::string value = text(key);
  if (std::find(allowed.begin(), allowed.end(), value) == allowed.end()) {
    fail(key, fmt::format("is \"{}\", which is not known here", value),
         fmt::format("{}Known: {}.", did_you_mean(value, allowed), fmt::join(allowed, ", ")));
  }
  return value;
}

bool TableReader::flag_or(std::string_view key, bool fallback) {
  const toml::node* node = find(key);
  if (node == nullptr) return fallback;
  const auto value = node->value_exact<bool>();
  if (!value) fail(key, "is neither true nor false", fmt::format("Write {} = true or false.", key));
  return *value;
}

std::vector<double> TableReader::numbers(std::string_view key, std::optional<size_t> count,
                                         NumberRange range) {
  std::vector<double> values;
  for (const toml::node& node : need_array(key, count, "numbers")) {
    values.push_back(checked_number(key, node, range));
  }
  return values;
}

std::vector<int64_t> TableReader::integers(std::string_view key, std::optional<size_t> count,
                                           NumberRange range) {
  std::vector<int64_t> values;
  for (const toml::node& node : need_array(key, count, "whole numbers")) {
    values.push_back(checked_integer(key, node, range));
  }
  return values;
}

std::vector<std::string> TableReader::texts_or(std::string_view key, std::vector<std::string> fallback) {
  if (!has(key)) return fallback;
  std::vector<std::string> values;
  for (const toml::node& node : need_array(key, {}, "texts")) {
    const auto value = node.value_exact<std::string>();
    if (!value)
      fail(key, "holds something that is not a text", fmt::format("Write {} = [\"...\", \"...\"].", key));
    values.push_back(*value);
  }
  return values;
}

TableReader TableReader::table(std::string_view key) {
  const toml::node& node = need(key, "a table");
  if (!node.is_table()) fail(key, "is not a table", fmt::format("Write it as [{}].", dotted(key)));
  return child(*node.as_table(), key);
}

std::optional<TableReader> TableReader::table_if(std::string_view key) {
  if (!has(key)) return std::nullopt;
  return table(key);
}

std::vector<TableReader> TableReader::tables(std::string_view key) {
  const toml::node* node = find(key);
  if (node == nullptr) return {};
  if (!node->is_array_of_tables()) {
    fail(key, "is not a list of tables", fmt::format("Write each one as [[{}]].", dotted(key)));
  }
  std::vector<TableReader> blocks;
  for (const toml::node& element : *node->as_array()) {
    blocks.push_back(child(*element.as_table(), fmt::format("{}[{}]", key, blocks.size())));
  }
  return blocks;
}

std::vector<std::pair<std::string, double>> TableReader::named_numbers(NumberRange range) {
  std::vector<std::pair<std::string, double>> numbers;
  for (const auto& [key, node] : *table_) {
    const std::string name(key.str());
    numbers.emplace_back(name, number(name, range));
  }
  return numbers;
}

std::vector<std::pair<std::string, TableReader>> TableReader::named_tables() {
  std::vector<std::pair<std::string, TableReader>> blocks;
  for (const auto& [key, node] : *table_) {
    const std::string_view name = key.str();
    asked_.emplace(name);
    if (!node.is_table()) fail(name, "is not a table", fmt::format("Write it as [{}].", dotted(name)));
    blocks.emplace_back(std::string(name), child(*node.as_table(), name));
  }
  return blocks;
}

void TableReader::finish() {
  for (const auto& [key, node] : *table_) {
    const std::string_view name = key.str();
    if (asked_.contains(name)) continue;
    fail(name, "is not a key that is known here",
         did_you_mean(name, {asked_.begin(), asked_.end()}) + "Correct or remove it.");
  }
}

void TableReader::fail(std::string_view key, std::string problem, std::string remedy) const {
  const toml::node* node = table_->get(key);
  const auto line = node != nullptr ? node->source().begin.line : table_->source().begin.line;
  std::string place =
      line > 0 ? fmt::format("line {}, key {}", line, dotted(key)) : fmt::format("key {}", dotted(key));
  throw InputError({file_, std::move(place), std::move(problem), std::move(remedy)});
}

const toml::node* TableReader::find(std::string_view key) {
  asked_.emplace(key);
  return table_->get(key);
}

const toml::node& TableReader::need(std::string_view key, std::string_view what) {
  const toml::node* node = find(key);
  if (node != nullptr) return *node;
  if (const toml::key* meant = misspelt(key, *table_, asked_)) {
    fail(key, "is missing",
         fmt::format("There is \"{}\" on line {}: did you mean {}?", meant->str(), meant->source().begin.line,
                     key));
  }
  fail(key, "is missing", fmt::format("Add {} = {}.", key, what));
}

double TableReader::checked_number(std::string_view key, const toml::node& node,
                                   const NumberRange& range) const {
  const auto value = node.is_number() ? node.value<double>() : std::nullopt;
  if (!value) fail(key, "is not a number", fmt::format("Give {} that is {}.", key, describe(range)));
  if (!within(*value, range)) {
    fail(key, fmt::format("is {}", *value), fmt::format("It must be {}.", describe(range)));
  }
  return *value;
}

int64_t TableReader::checked_integer(std::string_view key, const toml::node& node,
                                     const NumberRange& range) const {
  const auto value = node.value_exact<int64_t>();
  if (!value) fail(key, "is not a whole number", "Write it without a decimal point.");
  if (!within(static_cast<double>(*value), range)) {
    fail(key, fmt::format("is {}", *value), fmt::format("It must be {}.", describe(range)));
  }
  return *value;
}

const toml::array& TableReader::need_array(std::string_view key, std::optional<size_t> count,
                                           std::string_view what) {
  const toml::node& node = need(key, fmt::format("a list of {}", what));
  const toml::array* array = node.as_array();
  if (array == nullptr) fail(key, "is not a list", fmt::format("Write {} = [..., ...].", key));
  if (count && array->size() != *count) {
    fail(key, fmt::format("has {} entries", array->size()), fmt::format("Give exactly {} {}.", *count, what));
  }
  return *array;
}

std::string TableReader::dotted(std::string_view key) const {
  return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
}

TableReader TableReader::child(const toml::table& table, std::string_view key) const {
  return {document_, &table, file_, dotted(key)};
}

}  // namespace diastole
