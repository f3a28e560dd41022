#pragma once
// How far a model has to pull the rig's parts from what is declared or was learnt of them, and how seldom parts are so far off.

#include "estimator/explain/rig/effect_sets.hpp"

namespace diastole::explain {

/// How seldom any part of a model's error, or any part of the rig, may be as far off by chance: two sds of one.
inline constexpr double surprising_by_chance = 0.0228, surprising_sds = 2.0;

/// How often a normal error lies further to one side.
double upper_tail(double sds);

/// Of the tolerances `u` (or what ends with them) of a model the one furthest from its prior, in sds of the list or of
/// what references left: to be a little coarser than in a fine rig is no strain.
double largest_tolerance(const rig::SessionProblem& problem, const rig::SessionModel& model,
                         const Eigen::VectorXd& u);
double largest_tolerance(const rig::SessionProblem& problem, const EffectSet& set);

/// The parts' sds that a model takes, over the described ones: 1, or less in a rig whose parts are finer throughout.
double fineness(const rig::SessionProblem& problem, const rig::SessionModel& model);

/// How often the largest of all is as far to either side.
double strain_by_chance(const rig::SessionProblem& problem, const rig::SessionModel& model,
                        const Eigen::VectorXd& u);

/// Is a set's so far off as is seldom by chance, of all?
bool is_strained(const rig::SessionProblem& problem, const EffectSet& set);

}  // namespace diastole::explain
