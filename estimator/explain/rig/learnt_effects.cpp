#include "estimator/explain/rig/learnt_effects.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "estimator/io/study_refusal.hpp"

namespace diastole::explain {
namespace {

/// The session's runs from which an effect was learnt.
std::string own_runs(const Effect& effect, const rig::Session& session) {
  std::string names;
  for (const rig::SessionRun& run : session.runs)
    if (std::ranges::count(effect.text().learnt_from, run.run_id) > 0)
      names += (names.empty() ? "" : ", ") + run.drive.place.name;
  return names;
}

void require_rivals(const Study& study, const rig::Session& session, const Effect& effect) {
  for (const std::string_view rival : effect.text().conflicts)
    if (session.effects.find(rival) == nullptr)
      refuse(
          study, "model.effect_files",
          fmt::format("{} was learnt, and {}, which predicted as well, is not among the effects",
                      effect.text().id, rival),
          fmt::format("Give its file, too: --with A.effect.toml B.effect.toml. Once something else excludes "
                      "it, take {} off the list looks_alike of {}.",
                      rival, effect.text().id));
}

}  // namespace

std::string set_aside_learnt(const Study& study, rig::Session& session) {
  std::string sentences;
  for (const Effect* effect : std::vector(session.effects.of_rig())) {
    if (effect->text().learnt_from.empty()) continue;
    const std::string runs = own_runs(*effect, session);
    if (runs.empty()) {
      require_rivals(study, session, *effect);
      continue;
    }
    session.effects.set_aside(*effect);
    sentences += fmt::format(
        " The effect {} was learnt from {} itself, which therefore cannot show that it is there: it is not "
        "named here. "
        "Record new runs, and explain those.",
        effect->text().id, runs);
  }
  return sentences;
}

}  // namespace diastole::explain
