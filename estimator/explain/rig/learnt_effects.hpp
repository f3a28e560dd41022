#pragma once
// Effects that were learnt (learned_term.hpp) and have become files. They fit the runs that they were learnt from by their
// making, all of them: no part of these is data that the curve was not fitted to, and no rule of set_verdict.hpp sees that.

#include <string>

#include "estimator/io/study.hpp"
#include "estimator/model/session.hpp"

namespace diastole::explain {

/// Takes those from what is looked for in the session that were learnt from a run of it. Returns a sentence for people on each,
/// with a space before; empty: there is none. Throws InputError, at model.effect_files of the study, for one that would compete
/// without a law that predicted as well: an id of its looks_alike that nothing has.
std::string set_aside_learnt(const Study& study, rig::Session& session);

}  // namespace diastole::explain
