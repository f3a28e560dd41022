#pragma once
// From study, wanted curve and the runs so far to the next drive: `diastole shape`, and each turn of `run --shape`.

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/shaping/learning.hpp"
#include "protocol/contract/input_error.hpp"
#include "tools/diastole/shape/pump.hpp"
#include "tools/diastole/shape/wanted_curve.hpp"

namespace diastole::shaping {

using Json = nlohmann::ordered_json;

struct ShapeRequest {
  WantedOptions wanted;
  std::filesystem::path study;
  std::filesystem::path rig;  ///< empty: as the study's first run describes it
  CyclePlan plan;
  double tolerance_percent = 5.0;  ///< of the range, up to which the specimen follows the curve
};

/// By how much the specimen's volume is off the wanted one.
struct Deviation {
  double nrmse = 0.0;        ///< about the mean
  double level_mL = 0.0;     ///< mean volume less the wanted one
  double level_sd_mL = 0.0;  ///< of a level that was measured
};

struct Shaping {
  Lesson lesson;
  PlannedCycle cycle;                 ///< of lesson.drive_mL
  std::string binding_limit;          ///< that holds the drive back; empty: none
  std::optional<InputFault> refusal;  ///< why that drive must not be played
  Deviation seen;  ///< of the best run, or the last if none counts; before any, as the model expects
  /// Of lesson.drive_mL: as the model expects, or as the best run showed where learning has ended.
  Deviation drive;
};

class Shaper {
 public:
  /// Reads and solves what does not change. Throws InputError.
  explicit Shaper(const ShapeRequest& request);

  /// After these runs, in their order. Throws InputError if one cannot be used. A drive with a refusal is for no pump.
  [[nodiscard]] Shaping after(const std::vector<std::filesystem::path>& runs) const;
  [[nodiscard]] const PeriodicCurve& wanted_mL() const { return wanted_mL_; }
  [[nodiscard]] const CyclePlan& plan() const { return request_.plan; }
  [[nodiscard]] double tolerance() const { return request_.tolerance_percent / 100.0; }
  /// The same share of the range as the shape has, and three of its errors: they come on top of what the specimen does.
  [[nodiscard]] double level_tolerance_mL(const Deviation& off) const {
    return tolerance() * wanted_mL_.range() + 3.0 * off.level_sd_mL;
  }
  /// Whether the specimen follows the curve, in shape and in level.
  [[nodiscard]] bool is_within_tolerance(const Deviation& off) const {
    return off.nrmse <= tolerance() && std::abs(off.level_mL) <= level_tolerance_mL(off);
  }
  /// Why the answer is negative, with what may be done. `who`: "this drive".
  [[nodiscard]] std::string miss_in_words(std::string_view who, const Deviation& off) const;
  [[nodiscard]] std::string target() const { return request_.wanted.file.filename().string(); }

 private:
  /// The lesson's drive as the pump plays it, and why it would be refused.
  void plan_cycle(Shaping& shaping) const;
  [[nodiscard]] std::optional<InputFault> refusal_of(const PlannedCycle& cycle) const;
  void estimate_deviations(Shaping& shaping) const;

  ShapeRequest request_;
  WantedCurve target_;
  Pump pump_;
  DriveModel model_;
  PeriodicCurve wanted_mL_;
  PeriodicCurve first_mL_;
  bool first_is_bounded_ = false;
};

/// Throws InputError if it must not be played.
inline void require_playable(const Shaping& shaping) {
  if (shaping.refusal) throw InputError(*shaping.refusal);
}

/// {"nrmse", "binding_limit", "iterations": [...], ...}; what is plotted is not in it.
Json shaping_json(const Shaping& shaping);
std::string shaping_words(const Shaping& shaping);
/// Self-contained, with the plots of each iteration.
std::string shaping_page(const Shaping& shaping, const PeriodicCurve& wanted_mL, const std::string& target);

}  // namespace diastole::shaping
