#pragma once
// From study, wanted curve and the runs so far to the next drive: `diastole shape`, and each turn of `run --shape`.

#include <filesystem>
#include <nlohmann/json.hpp>

#include "estimator/shaping/learning.hpp"
#include "tools/diastole/shape/pump.hpp"
#include "tools/diastole/shape/wanted_curve.hpp"

namespace diastole::shaping {

using Json = nlohmann::ordered_json;

struct ShapeRequest {
  WantedOptions wanted;
  std::filesystem::path study;
  std::filesystem::path rig;  ///< empty: as the study's first run describes it
  CyclePlan plan;
};

struct Shaping {
  Lesson lesson;
  PlannedCycle cycle;         ///< of lesson.drive_mL
  std::string binding_limit;  ///< that holds the drive back; empty: none
  double nrmse = 0.0;  ///< of the best run, or the last if none counts; before any, as the model expects
};

class Shaper {
 public:
  /// Reads and solves what does not change. Throws InputError.
  explicit Shaper(const ShapeRequest& request);

  /// After these runs, in their order. Throws InputError if one cannot be used.
  [[nodiscard]] Shaping after(const std::vector<std::filesystem::path>& runs) const;
  [[nodiscard]] const PeriodicCurve& wanted_mL() const { return wanted_mL_; }
  [[nodiscard]] const CyclePlan& plan() const { return request_.plan; }
  [[nodiscard]] std::string target() const { return request_.wanted.file.filename().string(); }

 private:
  /// The lesson's drive as the pump plays it. Throws InputError if the controller would refuse it.
  void plan_cycle(Shaping& shaping) const;

  ShapeRequest request_;
  DriveModel model_;
  Pump pump_;
  PeriodicCurve wanted_mL_;
  PeriodicCurve first_mL_;
  bool first_is_bounded_ = false;
};

/// {"nrmse", "binding_limit", "iterations": [...], ...}; what is plotted is not in it.
Json shaping_json(const Shaping& shaping);
std::string shaping_words(const Shaping& shaping);
/// Self-contained, with the plots of each iteration.
std::string shaping_page(const Shaping& shaping, const PeriodicCurve& wanted_mL, const std::string& target);

}  // namespace diastole::shaping
