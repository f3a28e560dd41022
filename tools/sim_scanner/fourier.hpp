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

/// The spectrum that a scanner measures of an object with several samples a pixel each way: as many lines as pixels, none of the finer ones
/// folded in, in the scale of the pixels' own spectrum. Precondition: the object is square, of whole pixels. Sample (0, 0) is the first of
/// pixel (0, 0), whose centre lies in the middle of its samples. Back: `transform`, as above.
Spectrum measured_spectrum(Spectrum object, Eigen::Index samples_a_pixel);

}  // namespace diastole::scanner
