#include "tools/sim_scanner/fourier.hpp"

#include <fftw3.h>

#include <mutex>
#include <numbers>

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

Spectrum measured_spectrum(Spectrum object, Eigen::Index samples_a_pixel) {
  transform(object, -1);
  const Eigen::Index fine = object.rows(), n = fine / samples_a_pixel;
  const auto samples = static_cast<double>(samples_a_pixel);
  Spectrum measured(n, n);
  for (Eigen::Index column = 0; column < n; ++column) {
    for (Eigen::Index row = 0; row < n; ++row) {
      const double ky = signed_line(row, n), kx = signed_line(column, n);
      const auto place = [&](double k) {
        return static_cast<Eigen::Index>(k < 0 ? k + static_cast<double>(fine) : k);
      };
      const double turn = std::numbers::pi * (samples - 1) / static_cast<double>(fine) * (kx + ky);
      measured(row, column) = std::complex<float>(std::complex<double>(object(place(ky), place(kx))) *
                                                  std::polar(1.0, turn) / (samples * samples));
    }
  }
  return measured;
}

}  // namespace diastole::scanner
