#pragma once
// The desk of tagged images: a folder's slices, the choices about them, and what was tracked with them. Tracking runs on a thread of its own;
// all else is called from the server's.
//
//   GET /tracking            {"html", "record"}: what was tracked; 503 before there is anything
//   GET /state               {"tracking", "done", "of", "version", "problem", "changed", "edits"}
//   POST /edits              one choice; answers as /state does
//   POST /track              tracks again; answers as /state does

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "estimator/imaging/tracking/tracked_folder.hpp"
#include "tools/diastole/desk/desk_pages.hpp"

namespace diastole::desk {

class TagDesk final : public DeskPages {
 public:
  /// Reads the choices, and begins to track. `tags`: where the points go after each tracking. Throws InputError for a folder that
  /// is not sound or without tags, and for choices that do not fit it.
  TagDesk(const imaging::ImageFolder& folder, imaging::TrackRequest request,
          std::optional<std::filesystem::path> tags);
  /// Waits for the slices that are being tracked; the others are given up.
  ~TagDesk() override;

  [[nodiscard]] std::span<const report::PageAsset> assets() const override;
  std::optional<DeskAnswer> get(std::string_view path) override;
  std::optional<DeskAnswer> post(std::string_view path, const std::string& body) override;

  [[nodiscard]] std::filesystem::path edits_file() const { return imaging::edits_file(request_); }

 private:
  using Choices = std::map<std::string, std::string>;  // of a slice, by its name

  /// Appends a choice (a JSON object, an undo included) to the file, and returns when the disk has it. Throws InputError, and leaves
  /// the file as it is, if it does not fit.
  void append(const std::string& choice);
  /// The choices that stand, each with the `line` that it has in the file.
  [[nodiscard]] nlohmann::json edits() const;

  /// Tracks the slices whose choices have changed; does nothing while it is at work.
  void track();
  /// "changed": slices that were tracked with other choices than those that stand.
  [[nodiscard]] nlohmann::json state() const;
  /// {"html", "record"} of estimator/report/cine.hpp as JSON, or nothing before the first tracking has ended.
  [[nodiscard]] std::shared_ptr<const std::string> tracking() const;

  [[nodiscard]] std::string file_text() const;
  [[nodiscard]] Choices choices() const;
  /// Slices whose choices are others than they were tracked with.
  [[nodiscard]] std::set<std::string> changed() const;
  void work(std::vector<imaging::TagView> views, imaging::ManualEdits edits);
  [[nodiscard]] std::string payload_of(const imaging::ManualEdits& edits, double seconds) const;

  imaging::TrackRequest request_;
  const std::optional<std::filesystem::path> tags_;
  std::vector<imaging::TagView> views_;  // in the folder's order; the worker reads their names
  std::vector<Finding> folder_problems_;
  imaging::ManualEdits edits_;
  Choices tracked_choices_;

  std::map<std::string, imaging::TrackedSlice> slices_;  // the worker's
  std::map<std::string, Finding> faults_;                // of slices that could not be tracked

  mutable std::mutex mutex_;  // guards what follows
  bool tracking_ = false;
  bool ending_ = false;
  size_t done_ = 0, of_ = 0;
  size_t version_ = 0;
  std::string problem_;
  std::shared_ptr<const std::string> payload_;

  std::jthread worker_;
};

}  // namespace diastole::desk
