#pragma once
// The desk of cines: guide points on a ventricle's walls, set and moved by hand, and the ventricle that is fitted to them. Every change is in
// the file NAME.guide.csv at once. The fit runs on a thread of its own; all else is called from the server's.
//
//   GET /images              {"folder", "guide", "slices": [{"name", "view", "rows", "columns", "pixel_mm", "images": [{"frame", "trigger_ms",
//                            "picture"}]}]}: a picture is 8 bits a pixel in base64, empty where the slice lacks the phase
//   GET /points              {"version", "points": [[id, slice, phase, surface, column, row, sigma_mm], ...]}; slice and phase are indices
//   GET /fit                 the walls where images show them; 503 before there are any: {"version", "phases": [{"cavity_mL", "cavity_sigma_mL",
//                            "wall_mL"} or null], "slices": [{"inner", "outer"}], "rms_mm", "noise_factor", "converged", "problems"}: of a slice for
//                            each phase pieces of lines, four numbers each: column, row, column, row
//   GET /state               {"version", "points", "elsewhere", "undoable", "fitting", "fitted_version", "problem"}
//   POST /points             one change (GuideDesk::change); answers as /state does
//   POST /fit                fits again; answers as /state does

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "estimator/imaging/geometry/cines.hpp"
#include "estimator/imaging/geometry/ventricle_session.hpp"
#include "tools/diastole/desk/desk_pages.hpp"

namespace diastole::desk {

class GuideDesk final : public DeskPages {
 public:
  /// Points are those of `guide`; where there is no such file, those that are found in the cines, and the file is written. Throws InputError for
  /// a folder without cines, and for points that lie in none of their slices.
  GuideDesk(const imaging::ImageFolder& folder, std::filesystem::path guide);
  /// Waits for a fit.
  ~GuideDesk() override = default;

  [[nodiscard]] std::span<const report::PageAsset> assets() const override;
  std::optional<DeskAnswer> get(std::string_view path) override;
  std::optional<DeskAnswer> post(std::string_view path, const std::string& body) override;

 private:
  /// The new value of each point by its number, which it keeps; no value removes it.
  using Change = std::map<size_t, std::optional<imaging::GuidePoint>>;

  /// Of the file or, where there is none, found in the images; none where none are seen.
  imaging::GuidePoints known_points();
  void read_points();
  void require_in_slices() const;
  /// {"action": "move", "point": id, "to": [column, row]}
  /// {"action": "set", "slice": index, "phase": index, "surface": "endo", "at": [[column, row], ...]}
  /// {"action": "remove", "points": [id, ...]}
  /// {"action": "undo"}
  /// The disk has it when this returns. Throws InputError, and leaves points and file as they are, if it does not fit.
  void change(const std::string& text);
  [[nodiscard]] Change parsed(const nlohmann::json& choice) const;
  /// Sets the points, and returns the change that takes it back.
  Change apply(const Change& change);
  /// What the fit and the file get.
  [[nodiscard]] imaging::GuidePoints guide() const;
  void write();
  void fit();
  void run_fit(const imaging::GuidePoints& guide, size_t version);

  [[nodiscard]] std::string images_json() const;
  [[nodiscard]] std::string points_json() const;
  [[nodiscard]] std::string fit_json(const imaging::VentricleSession& session, size_t version) const;
  [[nodiscard]] std::string state_json() const;

  const std::filesystem::path file_;
  const imaging::Cines cines_;
  const std::shared_ptr<const std::string> images_;
  std::vector<int> phases_;          // the cines' and the file's, rising
  std::vector<std::string> slices_;  // the cines', then others of the file
  std::vector<Finding> findings_;    // of the points' source
  std::map<size_t, imaging::GuidePoint> points_;
  size_t next_ = 0, version_ = 1;
  std::vector<Change> undoing_;
  std::string written_;  // what the file held when it was last read or written

  mutable std::mutex mutex_;  // guards what follows
  bool fitting_ = false;
  size_t fitted_version_ = 0;
  std::string problem_;
  std::shared_ptr<const std::string> fit_;

  std::jthread worker_;
};

}  // namespace diastole::desk
