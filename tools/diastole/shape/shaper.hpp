#pragma once
// From study, wanted curve and the runs so far to the next drive: `diastole shape`, and each turn of `run --shape`.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

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
  double tolerance_percent = 5.0;  ///< NRMSE up to which the specimen follows the curve
};

struct Shaping {
  Lesson lesson;
  PlannedCycle cycle;         ///< of lesson.drive_mL
  std::string binding_limit;  ///< that holds the drive back; empty: none
  double nrmse = 0.0;  ///< of the best run, or the last if none counts; before any, as the model expects
  /// Of lesson.drive_mL: as the model expects, or as the best run showed where learning has ended.
  double drive_nrmse = 0.0;
};

class Shaper {
 public:
  /// Reads and solves what does not change. Throws InputError.
  explicit Shaper(const ShapeRequest& request);

  /// After these runs, in their order. Throws InputError if one cannot be used.
  [[nodiscard]] Shaping after(const std::vector<std::filesystem::path>& runs) const;
  [[nodiscard]] const PeriodicCurve& wanted_mL() const { return wanted_mL_; }
  [[nodiscard]] const CyclePlan& plan() const { return request_.plan; }
  [[nodiscard]] bool is_within_tolerance(double nrmse) const {
    return 100.0 * nrmse <= request_.tolerance_percent;
  }
  [[nodiscard]] double tolerance() const { return request_.tolerance_percent / 100.0; }
  /// Why the answer is negative, with what may be done. `who`: "this drive".
  [[nodiscard]] std::string miss_in_words(std::string_view who, double nrmse) const;
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
