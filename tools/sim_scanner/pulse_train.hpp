#pragma once
// What a tagging train leaves of the longitudinal magnetisation: SPAMM (Axel and Dougherty, Radiology 171 (1989) 841) and its
// binomial relatives (172 (1989) 349). Pulses about one axis with a gradient between them, which turns the magnetisation by phi
// about the field; what is transverse at the end is spoiled.

#include <span>

namespace diastole::scanner {

/// Mz / M0 where the gradient turns by `phase_rad` between two pulses; their flip angles are `weights` in proportion, `flip_rad` in all.
/// A whole flip of 90 degrees leaves nothing at phase 0.
double tagged_magnetisation(std::span<const double> weights, double flip_rad, double phase_rad);

/// Mz / M0 a time later, T1 having worked on it: 1 - (1 - m) exp(-t / T1).
double recovered(double magnetisation, double time_s, double T1_s);

}  // namespace diastole::scanner
