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

/// The image between its pixels too, `finer` places a pixel each way, by zeros for the lines that were not measured: (finer * row, finer * column)
/// is the pixel (row, column). Periodic, as the transform is: beyond the last pixel the first follows.
Image zero_filled(const Image& image, Eigen::Index finer);

}  // namespace diastole::imaging
