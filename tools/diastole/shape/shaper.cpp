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

constexpr const char* raise_cavity_limit =
    "Want less; or, if specimen and rig bear more, say so by controller.limits.cavity_kPa of a rig file "
    "(--rig).";

[[noreturn]] void refuse_target(const ShapeRequest& request, const WantedCurve& target,
                                const std::string& problem, const char* remedy) {
  throw InputError(
      {request.wanted.file.string(), fmt::format("line {}", target.greatest_line),
       fmt::format("asks for {:g} {}, and {}", target.greatest, target.is_pressure ? "kPa" : "mL", problem),
       remedy});
}

/// The volume up to which the specimen's curve has to be known. Throws InputError if the target is beyond the specimen or the rig's limit.
double largest_volume_mL(const ShapeRequest& request, const WantedCurve& target, double cavity_limit_kPa) {
  constexpr double room = 1.3;                // for runs that go beyond what is wanted
  constexpr double beyond_any_mL = 50'000.0;  // of what pumps displace
  const std::string limit = fmt::format("the rig's limit cavity_kPa is {:g}", cavity_limit_kPa);
  if (target.is_pressure && target.greatest > cavity_limit_kPa)
    refuse_target(request, target, limit, raise_cavity_limit);
  const rig::SpecimenReach reach =
      specimen_reach(read_study(request.study), target.is_pressure ? beyond_any_mL : room * target.greatest,
                     room * (target.is_pressure ? target.greatest : cavity_limit_kPa));
  if (target.greatest > (target.is_pressure ? reach.pressure_kPa : reach.volume_mL)) {
    const std::string reached = fmt::format("{:.3g} kPa at {:g} mL", reach.pressure_kPa, reach.volume_mL);
    if (!reach.is_end)
      refuse_target(request, target, fmt::format("the specimen holds {}: {}", reached, limit),
                    raise_cavity_limit);
    refuse_target(request, target, fmt::format("the specimen's pressure rises to {} at the most", reached),
                  "Want less: `diastole pv` shows its pressure by its volume.");
  }
  return reach.is_end && !target.is_pressure ? target.greatest : reach.volume_mL;
}

DriveModel model_of(const ShapeRequest& request, const WantedCurve& target, double cavity_limit_kPa) {
  if (request.plan.cycles < request.plan.settling + 6) {
    throw InputError({"", "option --cycles", fmt::format("{} are too few", request.plan.cycles),
                      fmt::format("The first {} set in, and six are averaged: give {} or more.",
                                  request.plan.settling, request.plan.settling + 6)});
  }
  return drive_model_of(read_study(request.study), largest_volume_mL(request, target, cavity_limit_kPa),
                        request.plan);
}

/// Of a pressure. Throws InputError if the effects of the study make the specimen end before.
PeriodicCurve wanted_volume(const ShapeRequest& request, const WantedCurve& target, const DriveModel& model) {
  if (!target.is_pressure) return target.curve;
  const PeriodicCurve volume = specimen_volume(model, target.curve, fine);
  const double greatest_mL = std::ranges::max(volume.at_even(static_cast<size_t>(4 * fine)));
  const rig::SpecimenCurve& curve = model.model().curve;
  const double end_mL = curve.points().back().volume_mL;
  if (greatest_mL <= end_mL) return volume;
  refuse_target(request, target,
                fmt::format("with its effects the study's specimen reaches {:.3g} kPa at {:g} mL at the most",
                            model.model().modulus_kPa * curve.at(end_mL).pressure_kPa, end_mL),
                "Want less.");
}

/// What a level that is off points to.
const char* cause_of(double level_mL) {
  return level_mL < 0.0
             ? "What leaks from cycle to cycle no drive that repeats itself brings back; or a limit "
               "holds the drive down."
             : "The specimen was fuller when the run began than is thought, the transducer's zero has "
               "drifted, or the piston would have to go below home.";
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
    : request_(request),
      target_(read_wanted_curve(request.wanted)),
      pump_(rig_of(request)),
      model_(model_of(request, target_, pump_.cavity_limit_kPa())),
      wanted_mL_(wanted_volume(request, target_, model_)) {
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
  estimate_deviations(shaping);
  return shaping;
}

void Shaper::plan_cycle(Shaping& shaping) const {
  Lesson& lesson = shaping.lesson;
  shaping.cycle = pump_.planned(lesson.drive_mL);
  const bool is_to_be_played = lesson.ending != Ending::changed;
  if (!shaping.cycle.refusal.empty() && is_to_be_played) {
    // A drive that was run, read back from its points, may be a rounding beyond a limit that it had reached.
    lesson.drive_mL = pump_.nearest(lesson.drive_mL, model_.jacobian(lesson.drive_mL));
    shaping.cycle = pump_.planned(lesson.drive_mL);
  }
  shaping.binding_limit = binding_of(shaping);
  shaping.cycle.limits.push_back({"cavity", lesson.greatest_kPa, pump_.cavity_limit_kPa(), "kPa"});
  if (is_to_be_played) shaping.refusal = refusal_of(shaping.cycle);
}

std::optional<InputFault> Shaper::refusal_of(const PlannedCycle& cycle) const {
  const auto refused = [&](const std::string& problem, const char* remedy) {
    return InputFault{request_.wanted.file.string(), "drive", problem, remedy};
  };
  if (cycle.refusal == unfit_waveform) {
    return refused(
        "the controller would refuse its waveform: it turns more sharply than 4294 strokes a period squared",
        "Smooth the curve, or give each of its waves a cycle of its own.");
  }
  if (!cycle.refusal.empty()) {
    const auto use = std::ranges::find(cycle.limits, cycle.refusal, &LimitUse::limit);
    return refused(
        use == cycle.limits.end()
            ? fmt::format("the controller would refuse it by its limit {}", cycle.refusal)
            : fmt::format("the controller would refuse it: {} is {:.6g} {}, and {:.6g} are allowed",
                          use->limit, use->asked, use->unit, use->allowed),
        "Want another range or a longer period, or give a rig with other limits (--rig).");
  }
  const LimitUse& cavity = cycle.limits.back();
  if (cavity.asked <= cavity.allowed) return {};
  return refused(fmt::format("with it the specimen is expected to hold {:.3g} kPa, and the rig's limit "
                             "cavity_kPa is {:g}",
                             cavity.asked, cavity.allowed),
                 raise_cavity_limit);
}

void Shaper::estimate_deviations(Shaping& shaping) const {
  const Lesson& lesson = shaping.lesson;
  PeriodicCurve expected = lesson.expected_mL;
  shaping.drive.level_mL = (expected.c[0] - wanted_mL_.c[0]).real();
  expected.c[0] = wanted_mL_.c[0];
  shaping.drive.nrmse =
      std::hypot(rms_between(expected, wanted_mL_), pump_.rounding_mL()) / wanted_mL_.range();
  shaping.seen = shaping.drive;
  if (!lesson.iterations.empty()) {
    const Iteration& shown = lesson.iterations[lesson.best.value_or(lesson.iterations.size() - 1)];
    shaping.seen = {shown.nrmse, shown.level_error_mL, shown.level_sd_mL};
    shaping.drive.level_sd_mL = shown.level_sd_mL;
  }
  if (lesson.ending != Ending::none) shaping.drive = shaping.seen;
}

std::string Shaper::miss_in_words(std::string_view who, const Deviation& off) const {
  std::string words;
  if (off.nrmse > tolerance())
    words += fmt::format(
        "With {} the specimen misses the curve by {:.2f} % of its range, and {:g} % are allowed "
        "(--tolerance-percent).\n  Want a smaller range or a longer period, or allow more.\n",
        who, 100.0 * off.nrmse, request_.tolerance_percent);
  if (std::abs(off.level_mL) > level_tolerance_mL(off))
    words += fmt::format(
        "With {} the specimen's mean volume is {:.2f} mL too {}, and {:.2f} mL are allowed "
        "(--tolerance-percent).\n  {}\n",
        who, std::abs(off.level_mL), off.level_mL < 0.0 ? "low" : "high", level_tolerance_mL(off),
        cause_of(off.level_mL));
  return words;
}

Json shaping_json(const Shaping& shaping) {
  const Lesson& lesson = shaping.lesson;
  const auto or_null = [](const std::string& text) { return text.empty() ? Json() : Json(text); };
  Json document{{"nrmse", shaping.seen.nrmse},
                {"drive_nrmse", shaping.drive.nrmse},
                {"drive_level_error_mL", shaping.drive.level_mL},
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
    text += fmt::format("by the model alone: NRMSE {:.2f} %, level {:+.2f} mL\n", 100.0 * shaping.seen.nrmse,
                        shaping.seen.level_mL);
  if (lesson.best) {
    const Iteration& best = lesson.iterations[*lesson.best];
    constexpr double much = 0.01;  // of the range: what the shape is held to
    const double part = std::abs(best.level_error_mL) / best.cavity_mL.range();
    if (part > much)
      text += fmt::format("its mean volume is {:+.2f} mL off, {:.0f} % of the range. {}\n",
                          best.level_error_mL, 100.0 * part, cause_of(best.level_error_mL));
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
