#pragma once
// The discrete Fourier transform of an image, in place.

#include <Eigen/Dense>
#include <complex>

namespace diastole::scanner {

using Spectrum = Eigen::ArrayXXcf;  ///< rows x columns

/// `sign` -1 to the spectrum, +1 back (then times the number of pixels). Threads may call it at once.
void transform(Spectrum& values, int sign);

/// The signed number of a line: cycles over `count` samples.
double signed_line(Eigen::Index line, Eigen::Index count);

}  // namespace diastole::scanner
