#include "tools/sim_scanner/fourier.hpp"

#include <fftw3.h>

#include <mutex>

namespace diastole::scanner {

void transform(Spectrum& values, int sign) {
  static std::mutex planning;  // the one part of FFTW that threads must not share
  auto* data = reinterpret_cast<fftwf_complex*>(values.data());
  std::unique_lock lock(planning);
  fftwf_plan plan = fftwf_plan_dft_2d(static_cast<int>(values.cols()), static_cast<int>(values.rows()), data,
                                      data, sign, FFTW_ESTIMATE);
  lock.unlock();
  fftwf_execute(plan);
  lock.lock();
  fftwf_destroy_plan(plan);
}

double signed_line(Eigen::Index line, Eigen::Index count) {
  return static_cast<double>(2 * line > count ? line - count : line);
}

}  // namespace diastole::scanner
