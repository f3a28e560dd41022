#include "estimator/imaging/series/spectrum.hpp"

#include <fftw3.h>

#include <mutex>

namespace diastole::imaging {
namespace {

std::mutex& planner() {
  static std::mutex mutex;  // FFTW's planner is the one part of it that threads must not share
  return mutex;
}

}  // namespace

Eigen::ArrayXXcf spectrum_of(const Image& image) {
  Eigen::ArrayXXcf values = image.cast<std::complex<float>>();
  auto* data = reinterpret_cast<fftwf_complex*>(values.data());
  fftwf_plan plan = nullptr;
  {
    const std::scoped_lock lock(planner());
    // Eigen stores column by column: for FFTW the rows are the faster index.
    plan = fftwf_plan_dft_2d(static_cast<int>(image.cols()), static_cast<int>(image.rows()), data, data,
                             FFTW_FORWARD, FFTW_ESTIMATE);
  }
  fftwf_execute(plan);
  const std::scoped_lock lock(planner());
  fftwf_destroy_plan(plan);
  return values;
}

double signed_bin(Eigen::Index bin, Eigen::Index count) {
  return static_cast<double>(2 * bin > count ? bin - count : bin);
}

}  // namespace diastole::imaging
