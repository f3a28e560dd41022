#include "tools/diastole/runs/database.hpp"

#include <fmt/format.h>

#include <cstring>

namespace diastole::catalogue {
namespace {

/// For another process that is writing the same index.
constexpr int lock_timeout_ms = 60'000;

}  // namespace

Database::Database(const std::filesystem::path& file) {
  if (sqlite3_open(file.c_str(), &handle_) != SQLITE_OK) {
    const std::string problem = handle_ == nullptr ? "no memory" : sqlite3_errmsg(handle_);
    sqlite3_close(handle_);
    throw DatabaseError(problem);
  }
  sqlite3_busy_timeout(handle_, lock_timeout_ms);
}

void Database::execute(const std::string& sql) {
  char* problem = nullptr;
  if (sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, &problem) == SQLITE_OK) return;
  const std::string words = problem == nullptr ? "no memory" : problem;
  sqlite3_free(problem);
  throw DatabaseError(fmt::format("{} in: {}", words, sql));
}

Statement::Statement(const Database& database, const std::string& sql) : database_(database.handle()) {
  if (sqlite3_prepare_v2(database_, sql.c_str(), -1, &handle_, nullptr) != SQLITE_OK)
    throw DatabaseError(fmt::format("{} in: {}", sqlite3_errmsg(database_), sql));
}

void Statement::must(bool done) const {
  if (!done) throw DatabaseError(sqlite3_errmsg(database_));
}

void Statement::bind(int parameter, std::string_view text) {
  must(sqlite3_bind_text(handle_, parameter + 1, text.data(), static_cast<int>(text.size()),
                         SQLITE_TRANSIENT) == SQLITE_OK);
}
void Statement::bind(int parameter, int64_t number) {
  must(sqlite3_bind_int64(handle_, parameter + 1, number) == SQLITE_OK);
}
void Statement::bind(int parameter, double number) {
  must(sqlite3_bind_double(handle_, parameter + 1, number) == SQLITE_OK);
}
void Statement::bind(int parameter, std::span<const float> numbers) {
  must(sqlite3_bind_blob(handle_, parameter + 1, numbers.data(), static_cast<int>(numbers.size_bytes()),
                         SQLITE_TRANSIENT) == SQLITE_OK);
}

bool Statement::step() {
  const int result = sqlite3_step(handle_);
  if (result == SQLITE_ROW) return true;
  sqlite3_reset(handle_);
  must(result == SQLITE_DONE);
  sqlite3_clear_bindings(handle_);
  return false;
}

std::string Statement::text(int column) const {
  const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(handle_, column));
  return bytes == nullptr ? std::string()
                          : std::string(bytes, static_cast<size_t>(sqlite3_column_bytes(handle_, column)));
}

std::optional<int64_t> Statement::whole_if(int column) const {
  return is_null(column) ? std::nullopt : std::optional(sqlite3_column_int64(handle_, column));
}

std::optional<double> Statement::number_if(int column) const {
  return is_null(column) ? std::nullopt : std::optional(sqlite3_column_double(handle_, column));
}

std::vector<float> Statement::numbers(int column) const {
  const void* bytes = sqlite3_column_blob(handle_, column);
  std::vector<float> values(static_cast<size_t>(sqlite3_column_bytes(handle_, column)) / sizeof(float));
  if (!values.empty()) std::memcpy(values.data(), bytes, values.size() * sizeof(float));
  return values;
}

}  // namespace diastole::catalogue
