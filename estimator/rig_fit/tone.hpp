#pragma once
// A tone in the cavity's pressure that the cycle does not make: mains hum, a ventilator, a table that shakes.
//
// Features (segment_features.hpp) see what follows the cycle, up to some hertz; a tone of its own frequency counts there as noise. Here each
// segment of equal cycles but the first is a window. Its periodogram, without the bins that a periodic motion fills, is compared with the median
// of the bins around: where there is noise alone the ratio is nearly an exponential variable, and at one frequency those of all windows add up to a
// gamma variable (Welch 1967). A tone at a harmonic of a window's cycle cannot be separated from the motion there, and one beside it is seen in part: its
// size is at least what is found, and its frequency known to some bins. Of the pump's pressure nothing is said: the hose rings there.

#include <optional>

#include "estimator/model/session.hpp"

namespace diastole::rig {

struct Tone {
  double frequency_Hz = 0.0;
  double resolution_Hz = 0.0;   ///< of the longest window
  double rms_kPa = 0.0;         ///< without the noise in its bin
  double noise_kPa = 0.0;       ///< RMS of all other noise between the harmonics
  double excess_chi2 = 0.0;     ///< above what noise gives
  double p_value = 1.0;         ///< that noise has one as clear at any of the frequencies
  size_t run = 0, segment = 0;  ///< where it is clearest
};

/// The clearest one with p < 0.001 of those that half of the windows can show and half of these do. Windows with gaps and those shorter than
/// four cycles show nothing.
std::optional<Tone> find_tone(const Session& session);

}  // namespace diastole::rig
