// Images between their pixels, and where the simulated scanner's edges lie.

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "estimator/imaging/series/spectrum.hpp"
#include "tools/sim_scanner/slice_image.hpp"

namespace diastole::imaging {
namespace {

TEST(ZeroFilled, IsTheWaveItselfBetweenItsPixels) {
  constexpr Eigen::Index rows = 16, columns = 15, finer = 4;
  const auto wave = [](double row, double column) {
    return 3 + std::cos(2 * std::numbers::pi * (7 * row / rows - 0.1)) *
                   std::sin(2 * std::numbers::pi * 6 * column / columns);
  };
  Image image(rows, columns);
  for (Eigen::Index r = 0; r < rows; ++r)
    for (Eigen::Index c = 0; c < columns; ++c)
      image(r, c) = static_cast<float>(wave(static_cast<double>(r), static_cast<double>(c)));
  const Image fine = zero_filled(image, finer);
  ASSERT_EQ(fine.rows(), finer * rows);
  ASSERT_EQ(fine.cols(), finer * columns);
  for (Eigen::Index r = 0; r < fine.rows(); ++r)
    for (Eigen::Index c = 0; c < fine.cols(); ++c)
      EXPECT_NEAR(fine(r, c), wave(static_cast<double>(r) / finer, static_cast<double>(c) / finer), 1e-5);
}

TEST(ZeroFilled, KeepsThePixelsOfAnyImage) {
  const Image image = Image::Random(16, 14);
  const Image fine = zero_filled(image, 4);
  for (Eigen::Index r = 0; r < image.rows(); ++r)
    for (Eigen::Index c = 0; c < image.cols(); ++c)
      EXPECT_NEAR(fine(4 * r, 4 * c), image(r, c), 1e-5);
}

/// Where a row of the image falls through the middle of 2 and 1, in pixels.
double edge_in(const Image& image, Eigen::Index row, Eigen::Index from) {
  const auto grey = [&](Eigen::Index column) { return static_cast<double>(image(row, column)); };
  for (Eigen::Index c = from; c < image.cols(); ++c)
    if (grey(c) < 1.5) return static_cast<double>(c - 1) + (grey(c - 1) - 1.5) / (grey(c - 1) - grey(c));
  return 0;
}

TEST(SimulatedImage, ShowsAnEdgeWhereItIsWithinItsPixel) {
  scanner::ScanProtocol protocol;
  protocol.matrix = 64;
  protocol.snr = 1e6;
  constexpr int samples = scanner::samples_a_pixel;
  for (int shift = 0; shift < 2 * samples; ++shift) {
    // Bright up to the edge at sample 32 * samples + shift; a pixel's centre is in the middle of its samples.
    scanner::Picture object = scanner::Picture::Ones(64 * samples, 64 * samples);
    object.leftCols(32 * samples + shift) = 2;
    const double true_edge = 32 + static_cast<double>(shift) / samples - 0.5;
    const Image across = zero_filled(scanner::acquired(object, protocol, 1), 4);
    EXPECT_NEAR(edge_in(across, 4 * 20, 4 * 25) / 4, true_edge, 0.01) << shift;
    const Image down = zero_filled(scanner::acquired(object.transpose(), protocol, 1), 4);
    EXPECT_NEAR(edge_in(down.transpose(), 4 * 20, 4 * 25) / 4, true_edge, 0.01) << shift;
  }
}

}  // namespace
}  // namespace diastole::imaging
