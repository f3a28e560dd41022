#pragma once
// What references know of the rig's parts does not hold for those that an effect changes.
//
// A hose that is softer or heavier than at commissioning is another hose: its length, bore, wall and losses are known as of
// any declared one, by the tolerances' list, about where the references found them.

#include <string_view>

#include "estimator/rig_fit/base_fit.hpp"

namespace diastole::explain {

/// Is this a tolerance of a part that an effect of the model changes ("hose_bore" of the "hose", EffectDeclaration::changes)?
bool is_changed(const rig::SessionModel& model, std::string_view part);

/// `start`, whose u is by the prior of `known`, and the same columns, by the prior that its effects leave.
struct FreedStart {
  rig::SessionModel start;
  rig::LinearisedModel known;
};
FreedStart free_changed_parts(const rig::SessionProblem& problem, rig::SessionModel start,
                              rig::LinearisedModel known);

}  // namespace diastole::explain
