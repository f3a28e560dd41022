#include "tools/sim_scanner/slice_image.hpp"

#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "protocol/contract/angle.hpp"
#include "tools/sim_scanner/fourier.hpp"
#include "tools/sim_scanner/pulse_train.hpp"

namespace diastole::scanner {
namespace {

constexpr int through_samples = 6;
constexpr double soft_edge = 0.15;                 // of the thickness: where the slice's profile falls
constexpr double water_brightness = 0.65;          // beside tissue's, with tags
constexpr double balanced_water_brightness = 1.8;  // without
constexpr double stirred_T_s = 0.08, bath_T1_s = 2.8;

/// The profile across the slice, s in thicknesses from its middle.
double profile(double s) { return 0.5 * (std::erf((s + 0.5) / soft_edge) - std::erf((s - 0.5) / soft_edge)); }

/// Of a sample, in its own size: where within it layer s is looked at. No two layers share a row, a column or a diagonal, so that an edge along
/// the pixels, as the plane of a base is, lies where it is to a third of a sample; layers that lie alike about the slice's middle are looked
/// at in opposite places, so that no image is displaced.
std::array<double, 2> within_sample(int s) {
  constexpr std::array<int, through_samples> column{2, 0, 4, 1, 5, 3};
  return {(column[static_cast<size_t>(s)] + 0.5) / through_samples - 0.5, (s + 0.5) / through_samples - 0.5};
}

class Signal {
 public:
  Signal(const ScanProtocol& protocol, const std::vector<TagPlane>& tags, double time_s)
      : protocol_(protocol), tags_(tags), time_s_(time_s) {
    for (size_t i = 0; i < table_.size(); ++i)
      table_[i] = tagged_magnetisation(protocol.tags.weights, protocol.tags.flip_deg * rad_per_deg,
                                       2 * std::numbers::pi * static_cast<double>(i) / table_size);
  }

  [[nodiscard]] double at(const Spot& spot, const Eigen::Vector3d& x_mm) const {
    switch (spot.medium) {
      case Medium::nothing:
        return 0;
      case Medium::tissue:
        return recovered(tags_at(spot.X_mm), time_s_, protocol_.T1_s);
      case Medium::cavity:
        return water() * recovered(tags_at(x_mm), time_s_, stirred_T_s);
      case Medium::bath:
        return protocol_.dark_bath ? 0 : water() * recovered(tags_at(x_mm), time_s_, bath_T1_s);
    }
    return 0;
  }

 private:
  static constexpr int table_size = 1024;

  [[nodiscard]] double water() const { return tags_.empty() ? balanced_water_brightness : water_brightness; }
  [[nodiscard]] double tags_at(const Eigen::Vector3d& X_mm) const {
    double left = 1;
    for (const TagPlane& tag : tags_) {
      const double turns = (tag.normal.dot(X_mm) - tag.offset_mm) / protocol_.tags.spacing_mm;
      const double place = table_size * (turns - std::floor(turns));
      const auto low = static_cast<size_t>(place) % table_size;
      const double share = place - std::floor(place);
      left *= (1 - share) * table_[low] + share * table_[(low + 1) % table_size];
    }
    return left;
  }

  const ScanProtocol& protocol_;
  const std::vector<TagPlane>& tags_;
  double time_s_;
  std::array<double, table_size> table_;
};

}  // namespace

Picture signal_of(const SliceOfBody& body, const ScanPlane& plane, const ScanProtocol& protocol,
                  const std::vector<TagPlane>& tags, double time_s) {
  const Signal signal(protocol, tags, time_s);
  const int count = protocol.matrix * samples_a_pixel;
  const double sample_mm = protocol.field_of_view_mm / count;
  std::array<double, through_samples> offset_mm, weight;
  double all = 0;
  for (int s = 0; s < through_samples; ++s) {
    const double share = ((s + 0.5) / through_samples - 0.5) * (1 + 4 * soft_edge);
    const auto at = static_cast<size_t>(s);
    offset_mm[at] = share * protocol.thickness_mm;
    weight[at] = profile(share);
    all += weight[at];
  }
  constexpr double first = 0.5 * (samples_a_pixel - 1);  // the first sample from its pixel's centre
  Picture picture(count, count);
  for (int row = 0; row < count; ++row) {
    for (int column = 0; column < count; ++column) {
      double sum = 0;
      for (int s = 0; s < through_samples; ++s) {
        const auto [right, down] = within_sample(s);
        const double right_mm = sample_mm * (column - first + right),
                     down_mm = sample_mm * (row - first + down);
        const double through_mm = offset_mm[static_cast<size_t>(s)];
        const Spot spot = body.at({right_mm, down_mm, through_mm});
        if (spot.medium == Medium::nothing) continue;
        const Eigen::Vector3d x_mm = plane.first_mm + right_mm * plane.along_row +
                                     down_mm * plane.along_column + through_mm * plane.normal();
        sum += weight[static_cast<size_t>(s)] * signal.at(spot, x_mm);
      }
      // The coils lie to one side and below: sensitivity falls by `shading` towards the other corner.
      const double far = (row + column) / (2.0 * count);
      picture(row, column) = static_cast<float>(sum / all * (1 + protocol.shading * (0.5 - far)));
    }
  }
  return picture;
}

Picture acquired(const Picture& signal, const ScanProtocol& protocol, unsigned seed) {
  Spectrum spectrum = measured_spectrum(signal.cast<std::complex<float>>(), samples_a_pixel);
  const Eigen::Index rows = spectrum.rows();
  const double half = 0.5 * protocol.acquired * static_cast<double>(rows);
  std::mt19937 engine(seed);
  const double pixels = static_cast<double>(spectrum.size());
  std::normal_distribution<double> noise(0, std::sqrt(pixels / protocol.acquired) / protocol.snr);
  constexpr double taper = 0.1;  // of the measured lines, at either end
  for (Eigen::Index column = 0; column < spectrum.cols(); ++column) {
    for (Eigen::Index row = 0; row < rows; ++row) {
      const double line = signed_line(row, rows);
      const double from_end = (half - std::abs(line)) / (taper * 2 * half);
      if (from_end <= 0) {
        spectrum(row, column) = 0;
        continue;
      }
      const double window = from_end >= 1 ? 1 : 0.5 - 0.5 * std::cos(std::numbers::pi * from_end);
      const double imaginary = noise(engine), real = noise(engine);
      const std::complex<double> value =
          std::complex<double>(spectrum(row, column)) + std::complex<double>(real, imaginary);
      spectrum(row, column) = std::complex<float>(window * value);
    }
  }
  transform(spectrum, +1);
  return spectrum.abs() / static_cast<float>(pixels);
}

}  // namespace diastole::scanner
