#pragma once
// Strict reading of the TOML files that people write (rig, experiment, study): every key that is asked for is
// type-checked with its line in the message, and every key that was *not* asked for is an error that names
// the nearest known one. Values are read once, in any order; `finish()` closes a table.
//
//   TableReader root = TableReader::from_file("gel.study.toml");
//   root.expect_format("diastole-study", 1);
//   TableReader specimen = root.table("specimen");
//   double height_mm = specimen.number("height_mm", {.above = 0});
//   specimen.finish();
//   root.finish();
//
// Errors: every member throws InputError.

#include <toml++/toml.h>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace diastole {

/// A text with its place in the file, for what is read further: a formula.
struct PlacedText {
  std::string text;
  std::string file = {};
  std::string key = {};  ///< dotted
  size_t line = 1;       ///< of the text's first character
  size_t column = 1;

  /// "line 12, column 17, key equations.q_hose" of the character at this offset in bytes.
  [[nodiscard]] std::string place(size_t offset) const;
};

/// Open or closed bounds of a number; NaN is never accepted.
struct NumberRange {
  double above = -std::numeric_limits<double>::infinity();     ///< value > above
  double below = std::numeric_limits<double>::infinity();      ///< value < below
  double at_least = -std::numeric_limits<double>::infinity();  ///< value >= at_least
  double at_most = std::numeric_limits<double>::infinity();    ///< value <= at_most
};

class TableReader {
 public:
  /// Parses a file. Throws InputError if it is missing, unreadable or not TOML (with line and column).
  static TableReader from_file(const std::filesystem::path& path);
  /// Parses text that came from elsewhere (a run file's /protocol/toml); `name` stands for the file in
  /// messages. What is HDF5 or JSON is refused as that.
  static TableReader from_text(std::string_view text, std::string name);

  /// Demands `format = "name"` and `version = newest` or older (>= 1); returns the version found.
  int64_t expect_format(std::string_view name, int64_t newest);

  [[nodiscard]] bool has(std::string_view key);
  double number(std::string_view key, NumberRange range = {});
  double number_or(std::string_view key, double fallback, NumberRange range = {});
  int64_t integer(std::string_view key, NumberRange range = {});
  int64_t integer_or(std::string_view key, int64_t fallback, NumberRange range = {});
  /// Whether the key holds a text, where it may hold a number too.
  [[nodiscard]] bool has_text(std::string_view key);
  std::string text(std::string_view key);
  std::string text_or(std::string_view key, std::string fallback);
  PlacedText placed_text(std::string_view key);
  /// Every text with its name, in the order of the file, for tables whose keys are checked by whoever asks.
  std::vector<std::pair<std::string, PlacedText>> named_texts();
  /// A text that must be one of `allowed`; the message lists them and names the nearest.
  std::string choice(std::string_view key, const std::vector<std::string>& allowed);
  bool flag_or(std::string_view key, bool fallback);
  std::vector<double> numbers(std::string_view key, std::optional<size_t> count = {}, NumberRange range = {});
  std::vector<int64_t> integers(std::string_view key, std::optional<size_t> count = {},
                                NumberRange range = {});
  std::vector<std::string> texts_or(std::string_view key, std::vector<std::string> fallback);

  TableReader table(std::string_view key);
  std::optional<TableReader> table_if(std::string_view key);
  /// `[[key]]` blocks in order; empty if there is none.
  std::vector<TableReader> tables(std::string_view key);
  /// Every sub-table with its name, for tables whose keys the user chooses (`[law.parameters.C1_kPa]`).
  std::vector<std::pair<std::string, TableReader>> named_tables();

  /// Every number with its name, for tables whose keys another program knows (`[rig.tolerance]`).
  std::vector<std::pair<std::string, double>> named_numbers(NumberRange range = {});

  /// Throws if the table has a key that nobody asked for.
  void finish();

  /// Reports a fault of this table's key with file, line and dotted path.
  [[noreturn]] void fail(std::string_view key, std::string problem, std::string remedy) const;

  [[nodiscard]] const std::string& file() const { return file_; }

 private:
  TableReader(std::shared_ptr<const toml::table> document, const toml::table* table, std::string file,
              std::string path);

  const toml::node* find(std::string_view key);
  const toml::node& need(std::string_view key, std::string_view what);
  double checked_number(std::string_view key, const toml::node& node, const NumberRange& range) const;
  int64_t checked_integer(std::string_view key, const toml::node& node, const NumberRange& range) const;
  const toml::array& need_array(std::string_view key, std::optional<size_t> count, std::string_view what);
  [[nodiscard]] std::string dotted(std::string_view key) const;
  [[nodiscard]] TableReader child(const toml::table& table, std::string_view key) const;

  std::shared_ptr<const toml::table> document_;  // keeps `table_` alive
  const toml::table* table_;
  std::string file_;
  std::string path_;  // dotted path of this table, "" at the root
  std::set<std::string, std::less<>> asked_;
};

/// `Did you mean "x"? ` with the entry of `known` that is nearest to `word` or begins with it;
/// empty if less than half of `word` fits.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& known);

}  // namespace diastole
