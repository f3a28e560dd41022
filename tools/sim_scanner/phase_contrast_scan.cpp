#include "tools/sim_scanner/phase_contrast_scan.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <random>

#include "estimator/parallel/parallel_for.hpp"
#include "protocol/contract/angle.hpp"
#include "tools/sim_scanner/fourier.hpp"

namespace diastole::scanner {
namespace {

using std::numbers::pi;

constexpr int flow_samples_a_pixel = 6;

struct Moment {
  const FlowPhantom& phantom;
  const PhaseContrastProtocol& protocol;
  VelocityProfile profile;
  double shift_mm;  // of the tube

  /// Brightness and phase of a place, mm from the image's middle; `share` of the velocity encoding is in this image.
  [[nodiscard]] std::complex<double> signal(double x_mm, double y_mm, double share) const {
    const double shade = 1 + protocol.shading * (x_mm + y_mm) / (protocol.matrix * protocol.pixel_mm);
    const double tilt = std::cos(protocol.tilt_deg * rad_per_deg);
    // Distance from the tube's axis: the slice cuts it slantwise.
    const double radius_mm =
        std::hypot((x_mm - protocol.place_mm.x() - shift_mm) * tilt, y_mm - protocol.place_mm.y());
    const double bore_mm = 0.5 * phantom.bore_mm;
    if (radius_mm < bore_mm) {
      const double along_cm_s = profile.at(radius_mm);
      const double through = along_cm_s * tilt / protocol.venc_cm_s;
      const double bright = protocol.fluid_brightness * (1 + protocol.inflow * std::abs(through));
      return shade * std::polar(bright, share * pi * through);
    }
    if (radius_mm < bore_mm + phantom.wall_mm) return shade * protocol.wall_brightness;
    return std::hypot(x_mm, y_mm) < phantom.block_radius_mm ? shade : 0.0;
  }
};

/// The object's spectrum cut to the matrix, noise in each of its samples.
Spectrum image_of(const Moment& moment, double share, std::mt19937& engine) {
  const PhaseContrastProtocol& protocol = moment.protocol;
  const int fine = protocol.matrix * flow_samples_a_pixel;
  const double step_mm = protocol.pixel_mm / flow_samples_a_pixel;
  Spectrum object(fine, fine);
  for (int column = 0; column < fine; ++column) {
    for (int row = 0; row < fine; ++row) {
      const auto from_middle = [&](int i) { return step_mm * (i - 0.5 * (fine - 1)); };
      object(row, column) = std::complex<float>(moment.signal(from_middle(column), from_middle(row), share));
    }
  }
  const int n = protocol.matrix;
  Spectrum cut = measured_spectrum(std::move(object), flow_samples_a_pixel);
  const double half = 0.5 * protocol.acquired * n;
  std::normal_distribution<double> noise(0, n / protocol.snr);
  for (int column = 0; column < n; ++column) {
    for (int row = 0; row < n; ++row) {
      if (std::abs(signed_line(column, n)) > half || std::abs(signed_line(row, n)) > half) {
        cut(row, column) = 0;
        continue;
      }
      const double imaginary = noise(engine), real = noise(engine);
      cut(row, column) += std::complex<float>(std::complex<double>(real, imaginary));
    }
  }
  transform(cut, +1);
  return cut / static_cast<float>(n * n);
}

/// Magnitude, and phase in half turns.
std::pair<Picture, Picture> pictures_of(const Moment& moment, std::mt19937& engine) {
  const PhaseContrastProtocol& protocol = moment.protocol;
  const Spectrum encoded = image_of(moment, protocol.is_balanced ? 0.5 : 1.0, engine);
  const Spectrum reference = image_of(moment, protocol.is_balanced ? -0.5 : 0.0, engine);
  const int n = protocol.matrix;
  Picture magnitude(n, n), velocity(n, n);
  for (int column = 0; column < n; ++column) {
    for (int row = 0; row < n; ++row) {
      const auto from_middle = [&](int i) { return protocol.pixel_mm * (i - 0.5 * (n - 1)); };
      const double background =
          protocol.background_cm_s.dot(Eigen::Vector3d(1, from_middle(column) / 50, from_middle(row) / 50));
      const std::complex<double> both = std::complex<double>(encoded(row, column)) *
                                        std::conj(std::complex<double>(reference(row, column))) *
                                        std::polar(1.0, pi * background / protocol.venc_cm_s);
      magnitude(row, column) = 0.5F * (std::abs(encoded(row, column)) + std::abs(reference(row, column)));
      velocity(row, column) = static_cast<float>(std::arg(both) / pi);
    }
  }
  return {magnitude, velocity};
}

}  // namespace

void scan_flow(const FlowPhantom& phantom, const PhaseContrastProtocol& protocol,
               const std::filesystem::path& folder) {
  double fastest = 0;
  for (int i = 0; i < 100; ++i)
    fastest = std::max(fastest, std::abs(phantom.flow_mL_s(phantom.period_s * i / 100)));
  parallel_for(static_cast<size_t>(protocol.phases), machine_threads(), [&](size_t k) {
    const int phase = static_cast<int>(k);
    if (protocol.missing_phase == phase + 1) return;
    const double time_s = protocol.time_s(phase, phantom.period_s);
    const Moment moment{phantom, protocol, VelocityProfile(phantom, time_s),
                        protocol.wobble_mm * phantom.flow_mL_s(time_s) / std::max(1e-9, fastest)};
    std::mt19937 engine(1000003U * protocol.seed + static_cast<unsigned>(phase));
    const auto [magnitude, velocity] = pictures_of(moment, engine);
    for (const bool is_velocity : {false, true}) {
      if (!is_velocity && !protocol.has_magnitude) continue;
      const bool is_interleaved = protocol.maker == Maker::ge;
      const int series = protocol.first_series + (is_interleaved || !is_velocity ? 0 : 1);
      const int instance = phase + 1 + (is_interleaved && is_velocity ? protocol.phases : 0);
      const auto uid = [&](int image) {
        return fmt::format("2.25.{}", (protocol.seed + 7ULL) * 1000000000ULL +
                                          static_cast<unsigned>(series) * 1000000ULL +
                                          static_cast<unsigned>(image));
      };
      const double half_mm = 0.5 * protocol.pixel_mm * (protocol.matrix - 1);
      const ImageLabel label{
          .study_uid = "2.25.77",
          .series_uid = uid(0),
          .image_uid = uid(instance),
          .series_number = series,
          .instance = instance,
          .trigger_ms = 1e3 * time_s,
          .interval_ms = 1e3 * phantom.period_s,
          .first_mm = protocol.middle_mm - half_mm * (protocol.along_row + protocol.along_column),
          .along_row = protocol.along_row,
          .along_column = protocol.along_column,
          .pixel_mm = protocol.pixel_mm,
          .thickness_mm = 5,
          .velocity = VelocityLabel{protocol.maker, protocol.venc_cm_s, protocol.says_venc, is_velocity}};
      write_dicom(folder / fmt::format("{}{:02}.dcm", is_velocity ? 'v' : 'm', phase + 1),
                  is_velocity ? velocity : magnitude, label);
    }
  });
}

}  // namespace diastole::scanner
