#pragma once
// The discrete Fourier transform of an image, by FFTW.

#include <Eigen/Dense>
#include <complex>

#include "estimator/imaging/dicom/dicom_file.hpp"

namespace diastole::imaging {

/// F(row, column) = sum over pixels of value * exp(-2 pi i (row * r / rows + column * c / columns)). Threads may call it at once.
Eigen::ArrayXXcf spectrum_of(const Image& image);

/// The signed frequency of a bin: cycles over `count` samples.
double signed_bin(Eigen::Index bin, Eigen::Index count);

}  // namespace diastole::imaging
