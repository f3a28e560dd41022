#include "estimator/imaging/series/spectrum.hpp"

#include <fftw3.h>

#include <mutex>

namespace diastole::imaging {
namespace {

std::mutex& planner() {
  static std::mutex mutex;  // FFTW's planner is the one part of it that threads must not share
  return mutex;
}

void transform(Eigen::ArrayXXcf& values, int sign) {
  auto* data = reinterpret_cast<fftwf_complex*>(values.data());
  fftwf_plan plan = nullptr;
  {
    const std::scoped_lock lock(planner());
    // Eigen stores column by column: for FFTW the rows are the faster index.
    plan = fftwf_plan_dft_2d(static_cast<int>(values.cols()), static_cast<int>(values.rows()), data, data,
                             sign, FFTW_ESTIMATE);
  }
  fftwf_execute(plan);
  const std::scoped_lock lock(planner());
  fftwf_destroy_plan(plan);
}

}  // namespace

Eigen::ArrayXXcf spectrum_of(const Image& image) {
  Eigen::ArrayXXcf values = image.cast<std::complex<float>>();
  transform(values, FFTW_FORWARD);
  return values;
}

Image zero_filled(const Image& image, Eigen::Index finer) {
  const Eigen::ArrayXXcf spectrum = spectrum_of(image);
  const Eigen::Index rows = image.rows(), columns = image.cols();
  Eigen::ArrayXXcf fine = Eigen::ArrayXXcf::Zero(finer * rows, finer * columns);
  const auto place = [finer](Eigen::Index bin, Eigen::Index count) {
    return 2 * bin > count ? bin + (finer - 1) * count : bin;
  };
  for (Eigen::Index column = 0; column < columns; ++column)
    for (Eigen::Index row = 0; row < rows; ++row)
      fine(place(row, rows), place(column, columns)) = spectrum(row, column);
  transform(fine, FFTW_BACKWARD);
  return fine.real() / static_cast<float>(image.size());
}

double signed_bin(Eigen::Index bin, Eigen::Index count) {
  return static_cast<double>(2 * bin > count ? bin - count : bin);
}

}  // namespace diastole::imaging
