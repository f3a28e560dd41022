#pragma once
// SQLite (sqlite.org) with its handles owned and its errors as exceptions.

#include <sqlite3.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace diastole::catalogue {

/// What SQLite says, with the statement.
class DatabaseError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Database {
 public:
  /// Opens or makes it; ":memory:" is one that is gone afterwards.
  explicit Database(const std::filesystem::path& file);
  ~Database() { sqlite3_close(handle_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  void execute(const std::string& sql);
  [[nodiscard]] sqlite3* handle() const { return handle_; }

 private:
  sqlite3* handle_ = nullptr;
};

/// One prepared statement. Parameters and columns count from 0.
class Statement {
 public:
  Statement(const Database& database, const std::string& sql);
  ~Statement() { sqlite3_finalize(handle_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  void bind(int parameter, std::string_view text);
  void bind(int parameter, int64_t number);
  void bind(int parameter, double number);
  void bind(int parameter, std::span<const float> numbers);
  template <typename Value>
  void bind(int parameter, const std::optional<Value>& value) {
    if (value) bind(parameter, *value);  // else it stays null
  }
  /// The next row; false after the last, and the statement can be bound anew.
  bool step();

  [[nodiscard]] std::string text(int column) const;
  [[nodiscard]] int64_t whole(int column) const { return sqlite3_column_int64(handle_, column); }
  [[nodiscard]] std::optional<int64_t> whole_if(int column) const;
  [[nodiscard]] std::optional<double> number_if(int column) const;
  [[nodiscard]] std::vector<float> numbers(int column) const;

 private:
  void must(bool done) const;
  [[nodiscard]] bool is_null(int column) const { return sqlite3_column_type(handle_, column) == SQLITE_NULL; }
  sqlite3* database_;
  sqlite3_stmt* handle_ = nullptr;
};

}  // namespace diastole::catalogue
