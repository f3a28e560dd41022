#include "tools/diastole/shape/shaper.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "estimator/shaping/specimen_volume.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/reader.hpp"
#include "tools/diastole/replay/replay_plan.hpp"

namespace diastole::shaping {
namespace {

constexpr Eigen::Index fine = 96;  ///< harmonics of a wanted curve

WantedCurve wanted_of(const ShapeRequest& request) { return read_wanted_curve(request.wanted); }

DriveModel model_of(const ShapeRequest& request, const WantedCurve& wanted) {
  constexpr double room = 1.3;  // for runs that go beyond what is wanted
  const std::vector<double> values = wanted.curve.at_even(static_cast<size_t>(4 * fine));
  const double largest_mL = wanted.is_pressure ? 0.0 : room * std::ranges::max(values);
  if (request.plan.cycles < request.plan.settling + 6) {
    throw InputError({"", "option --cycles", fmt::format("{} are too few", request.plan.cycles),
                      fmt::format("The first {} set in, and six are averaged: give {} or more.",
                                  request.plan.settling, request.plan.settling + 6)});
  }
  return drive_model_of(read_study(request.study), largest_mL, request.plan);
}

RigConfig rig_of(const ShapeRequest& request) {
  if (!request.rig.empty()) return read_rig(request.rig);
  const Study study = read_study(request.study);
  const runfile::RunFile file = runfile::open_run(study.data.runs.front());
  replay::ReplayPlan plan;
  replay::plan_rig(file, std::nullopt, plan);
  return read_rig(TableReader::from_text(plan.rig_toml, file.run.file + " /rig"));
}

Eigen::Index harmonics_of(const PeriodicCurve& wanted_mL) {
  constexpr double part = 1e-3, highest_Hz = 20.0;
  const auto most = static_cast<Eigen::Index>(std::clamp(highest_Hz * wanted_mL.period_s, 4.0, 24.0));
  return harmonics_needed(wanted_mL, part, most);
}

/// What of the limits holds a drive that is held back.
std::string binding_of(const Shaping& shaping) {
  if (!shaping.lesson.bounded || shaping.cycle.limits.empty()) return "";
  if (shaping.lesson.guarded) return "growth";
  const auto tightest = std::ranges::max_element(shaping.cycle.limits, {}, &LimitUse::share);
  constexpr double nearly = 0.9;  // the curve between the points turns harder than the drive
  return tightest->share() >= nearly ? tightest->limit : "home";
}

}  // namespace

Shaper::Shaper(const ShapeRequest& request)
    : request_(request), model_(model_of(request, wanted_of(request))), pump_(rig_of(request)) {
  const WantedCurve wanted = wanted_of(request);
  wanted_mL_ = wanted.is_pressure ? specimen_volume(model_, wanted.curve, fine) : wanted.curve;
  const PeriodicCurve free = model_.inverse(wanted_mL_, wanted_mL_.with(harmonics_of(wanted_mL_)));
  first_mL_ = pump_.nearest(free, model_.jacobian(free));
  first_is_bounded_ = rms_between(free, first_mL_) > 1e-6 * wanted_mL_.range();
}

Shaping Shaper::after(const std::vector<std::filesystem::path>& runs) const {
  std::vector<GatedRun> gated;
  std::set<std::string> known;
  for (const std::filesystem::path& file : runs) {
    const runfile::RecordedRun run = runfile::read_run(file);
    if (!known.insert(run.run_id).second)
      throw InputError(
          {file.string(), "option --after", "is a recording that is given twice", "Name each run once."});
    const std::optional<double> zero_kPa =
        gated.empty() ? std::nullopt : std::optional(gated.front().zero_kPa);
    gated.push_back(gated_run(run, model_, wanted_mL_.period_s, 2 * first_mL_.harmonics(), zero_kPa));
  }
  Shaping shaping{.lesson = learn(model_, wanted_mL_, first_mL_, gated,
                                  [&](const PeriodicCurve& drive, const Eigen::MatrixXd& slope) {
                                    return pump_.nearest(drive, slope);
                                  }),
                  .cycle = {},
                  .binding_limit = {}};
  if (gated.empty()) shaping.lesson.bounded = first_is_bounded_;
  plan_cycle(shaping);
  shaping.binding_limit = binding_of(shaping);
  PeriodicCurve expected = shaping.lesson.expected_mL;
  expected.c[0] = wanted_mL_.c[0];
  const std::vector<Iteration>& runs_so_far = shaping.lesson.iterations;
  shaping.drive_nrmse =
      std::hypot(rms_between(expected, wanted_mL_), pump_.rounding_mL()) / wanted_mL_.range();
  shaping.nrmse = shaping.drive_nrmse;
  if (!runs_so_far.empty())
    shaping.nrmse = runs_so_far[shaping.lesson.best.value_or(runs_so_far.size() - 1)].nrmse;
  if (shaping.lesson.ending != Ending::none) shaping.drive_nrmse = shaping.nrmse;
  return shaping;
}

std::string Shaper::miss_in_words(std::string_view who, double nrmse) const {
  return fmt::format(
      "With {} the specimen misses the curve by {:.2f} % of its range, and {:g} % are allowed "
      "(--tolerance-percent).\n  Want a smaller range or a longer period, or allow more.\n",
      who, 100.0 * nrmse, request_.tolerance_percent);
}

void Shaper::plan_cycle(Shaping& shaping) const {
  Lesson& lesson = shaping.lesson;
  shaping.cycle = pump_.planned(lesson.drive_mL);
  if (shaping.cycle.refusal.empty() || lesson.ending == Ending::changed) return;
  // A drive that was run, read back from its points, may be a rounding beyond a limit that it had reached.
  lesson.drive_mL = pump_.nearest(lesson.drive_mL, model_.jacobian(lesson.drive_mL));
  shaping.cycle = pump_.planned(lesson.drive_mL);
  const std::string& limit = shaping.cycle.refusal;
  if (limit.empty()) return;
  const auto use = std::ranges::find(shaping.cycle.limits, limit, &LimitUse::limit);
  throw InputError(
      {request_.wanted.file.string(), "drive",
       use == shaping.cycle.limits.end()
           ? fmt::format("the controller would refuse it: {}", limit)
           : fmt::format("the controller would refuse it: {} is {:.6g} {}, and {:.6g} are allowed", limit,
                         use->asked, use->unit, use->allowed),
       "Want a smaller range or a longer period, or give a rig with other limits (--rig)."});
}

Json shaping_json(const Shaping& shaping) {
  const Lesson& lesson = shaping.lesson;
  const auto or_null = [](const std::string& text) { return text.empty() ? Json() : Json(text); };
  Json document{{"nrmse", shaping.nrmse},
                {"drive_nrmse", shaping.drive_nrmse},
                {"binding_limit", or_null(shaping.binding_limit)}};
  document["iterations"] = Json::array();
  for (const Iteration& it : lesson.iterations)
    document["iterations"].push_back({{"run", it.run},
                                      {"source", it.source},
                                      {"nrmse", it.nrmse},
                                      {"noise_floor", it.floor},
                                      {"level_error_mL", it.level_error_mL},
                                      {"surprise", it.surprise}});
  document["best"] = lesson.best ? Json(*lesson.best) : Json();
  document["ending"] = in_words(lesson.ending);
  document["reason"] = or_null(lesson.reason);
  document["stroke_mL"] = shaping.cycle.stroke_mL;
  document["offset_mL"] = shaping.cycle.offset_mL;
  document["period_s"] = shaping.cycle.period_s;
  document["trigger_delay_ms"] = shaping.cycle.trigger_delay_ms;
  document["trigger_late_ms"] = shaping.cycle.trigger_late_ms;
  document["limits"] = Json::array();
  for (const LimitUse& use : shaping.cycle.limits)
    document["limits"].push_back(
        {{"limit", use.limit}, {"asked", use.asked}, {"allowed", use.allowed}, {"unit", use.unit}});
  document["harmonics"] = Json::array();
  for (const LearnedHarmonic& one : lesson.harmonics)
    if (one.frequency_Hz > 0.0)
      document["harmonics"].push_back(
          {{"frequency_Hz", one.frequency_Hz},
           {"gain", one.gain},
           {"phase_deg", one.phase_deg},
           {"gain_sd", one.gain_sd},
           {"contraction_expected", one.contraction_expected},
           {"contraction_found", one.contraction_found ? Json(*one.contraction_found) : Json()}});
  document["model"] = Json::array();
  for (const LearnedValue& one : lesson.model)
    document["model"].push_back({{"effect", one.effect}, {"parameter", one.parameter}, {"value", one.value}});
  return document;
}

std::string shaping_words(const Shaping& shaping) {
  const Lesson& lesson = shaping.lesson;
  std::string text;
  for (size_t i = 0; i < lesson.iterations.size(); ++i) {
    const Iteration& it = lesson.iterations[i];
    text += fmt::format("{} {}: NRMSE {:.2f} % by {} (noise {:.2f} %), level {:+.2f} mL{}\n", i + 1, it.run,
                        100.0 * it.nrmse, it.source, 100.0 * it.floor, it.level_error_mL,
                        lesson.best == i ? "  <- best" : "");
  }
  if (lesson.iterations.empty())
    text += fmt::format("by the model alone: NRMSE {:.2f} %\n", 100.0 * shaping.nrmse);
  if (lesson.best) {
    const Iteration& best = lesson.iterations[*lesson.best];
    constexpr double much = 0.01;  // of the range: what the shape is held to
    const double part = std::abs(best.level_error_mL) / best.cavity_mL.range();
    if (part > much)
      text += fmt::format(
          "its shape is right to that, its mean volume is {:+.2f} mL off, {:.0f} % of the range: "
          "what leaks from cycle to cycle no drive that repeats itself brings back\n",
          best.level_error_mL, 100.0 * part);
  }
  if (lesson.ending != Ending::none) text += fmt::format("{}: {}\n", in_words(lesson.ending), lesson.reason);
  text += fmt::format(
      "drive: stroke {:.3f} mL, offset {:.3f} mL, period {:g} s, trigger {:.1f} ms after the first step\n",
      shaping.cycle.stroke_mL, shaping.cycle.offset_mL, shaping.cycle.period_s,
      shaping.cycle.trigger_delay_ms);
  text += "limits used:";
  for (const LimitUse& use : shaping.cycle.limits)
    text += fmt::format(" {} {:.0f} %", use.limit, 100.0 * use.share());
  text += "\n";
  if (!shaping.binding_limit.empty())
    text += fmt::format("held back by: {}; this is the nearest curve within it\n", shaping.binding_limit);
  return text;
}

}  // namespace diastole::shaping
