#pragma once
// An effect that is declared in a file (estimator/effect_files) as one of the estimator's model. Its formulas run as
// programs; what they set enters where the built-in effects do:
//
//   V_piston   the drive's trace; flow and acceleration are its exact derivatives in time, or differences if it has states
//              or depends on the flow
//   q_hose     a leak past the seal: a conductance of the hose's linear end where it is nothing else, else a law of the pump's
//              end (pump_end.hpp)
//   p_pump     a loss of pressure at the pump's end of the hose
//   p          the specimen's memory
//   q_cavity   a leak at the cavity
//   p_seen     the cavity's sensor
//   t_seen     the samples' delay and skew
//   constants  those of the model, which they see as they were before
//
// States are integrated by an exponential Rosenbrock method of second order with the diagonal of the Jacobian: exactly where a
// state is linear in itself and what drives it is linear within a step, as relaxation is.

#include <filesystem>
#include <memory>

#include "estimator/effect_files/effect_file.hpp"
#include "estimator/effects/effect.hpp"

namespace diastole {

/// Throws InputError at a formula of which nothing finite can be made.
std::shared_ptr<const Effect> make_file_effect(effect_files::EffectFile file);

/// Throws InputError as read_effect_file does.
std::shared_ptr<const Effect> read_effect(const std::filesystem::path& file);

}  // namespace diastole
