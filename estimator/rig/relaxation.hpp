#pragma once
// Quasi-linear viscoelasticity of the specimen with exponentials (Y. C. Fung, Biomechanics, 1993):
//
//   p = p_e - sum g_i (p_e - h_i),     dh_i/dt = dp_e/dt - h_i / tau_i
//
// with p_e the elastic pressure: its modulus is the instantaneous one.

#include <vector>

#include "estimator/rig/rig_model.hpp"

namespace diastole::rig {

struct RelaxingPart {
  double part;    ///< g of the pressure,
  double time_s;  ///< which relaxes within tau
};

/// Parts of zero are none; without any the model stays as it is.
void add_relaxation(RigModel& model, std::vector<RelaxingPart> parts);

}  // namespace diastole::rig
