#pragma once
// One image: the signal of a slice's spots, seen through coils and a limited matrix, with noise.

#include <Eigen/Dense>
#include <optional>

#include "tools/sim_scanner/moving_body.hpp"

namespace diastole::scanner {

using Picture = Eigen::ArrayXXf;  ///< rows x columns

/// Tag planes  normal . X = offset + number spacing  of the undeformed body, in its axes; darkest there.
struct TagPlane {
  Eigen::Vector3d normal;
  double offset_mm;
};

/// Each way.
constexpr int samples_a_pixel = 3;

/// The signal, several samples a pixel, with a soft slice profile; tissue far from the coils' shade is 1. Tags that were laid at time 0 ride with
/// the tissue, stay in the bath's resting water and are gone in the cavity's within two phases.
Picture signal_of(const SliceOfBody& body, const ScanPlane& plane, const ScanProtocol& protocol,
                  const std::vector<TagPlane>& tags, double time_s);

/// What the scanner makes of it: the measured lines of its spectrum, tapered along the columns, complex noise in them, magnitude. Noise has a
/// standard deviation of 1 / snr in each channel.
Picture acquired(const Picture& signal, const ScanProtocol& protocol, unsigned seed);

}  // namespace diastole::scanner
