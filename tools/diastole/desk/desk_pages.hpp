#pragma once
// What the desk serves: a page with its scripts, what it asks for, and what a person does there.

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "estimator/report/cine.hpp"

namespace diastole::desk {

struct DeskAnswer {
  int status = 200;
  std::shared_ptr<const std::string> body;  ///< JSON; with another status a sentence
};

inline DeskAnswer answered(std::string json) {
  return {200, std::make_shared<const std::string>(std::move(json))};
}
inline DeskAnswer refused(int status, std::string_view sentence) {
  return {status, std::make_shared<const std::string>(std::string(sentence) + "\n")};
}

class DeskPages {
 public:
  DeskPages() = default;
  virtual ~DeskPages() = default;
  DeskPages(const DeskPages&) = delete;
  DeskPages& operator=(const DeskPages&) = delete;

  /// "/", and what no other desk's page has.
  [[nodiscard]] virtual std::span<const report::PageAsset> assets() const = 0;
  /// Nothing: there is no such thing here.
  virtual std::optional<DeskAnswer> get(std::string_view path) = 0;
  /// May throw InputError for what does not fit.
  virtual std::optional<DeskAnswer> post(std::string_view path, const std::string& body) = 0;
};

}  // namespace diastole::desk
