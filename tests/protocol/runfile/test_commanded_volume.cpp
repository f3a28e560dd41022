#include "protocol/runfile/commanded_volume.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <vector>

namespace diastole::runfile {
namespace {

using testing::DoubleNear;
using testing::IsNan;

/// A row each 10 ms from 1 s on, 2 mL/s; more rows than a block holds.
struct Ramp {
  std::vector<double> time_s, volume_mL;
  StreamRows rows;
  Ramp() {
    for (size_t i = 0; i < 3 * Series::block_rows; ++i) {
      time_s.push_back(1 + 0.01 * static_cast<double>(i));
      volume_mL.push_back(2 * (time_s.back() - 1));
    }
    volume_mL[50] = std::nan("");
    // As rows of a file are: handed over by copies.
    const auto copied = [](const std::vector<double>& from) {
      return Series(from.size(), [&from](size_t first, std::span<double> values) {
        std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(first), values.size(), values.begin());
      });
    };
    rows.time_s = copied(time_s);
    rows.values["commanded_mL"] = copied(volume_mL);
  }
};

TEST(CommandedVolume, IsStraightBetweenRowsForwardsAndBack) {
  const Ramp ramp;
  CommandedVolume volume(ramp.rows);
  const double last_s = ramp.time_s.back();
  for (double t = 2.0035; t < last_s; t += 1.7)
    ASSERT_THAT(volume.at(t), DoubleNear(2 * (t - 1), 1e-9));
  for (double t = last_s; t > 2; t -= 83.1)
    ASSERT_THAT(volume.at(t), DoubleNear(2 * (t - 1), 1e-9));
  EXPECT_EQ(volume.at(ramp.time_s[7]), ramp.volume_mL[7]);
}

TEST(CommandedVolume, IsUnknownOutsideAndBesideAMissingRow) {
  const Ramp ramp;
  CommandedVolume volume(ramp.rows);
  EXPECT_THAT(volume.at(0.99), IsNan());
  EXPECT_THAT(volume.at(ramp.time_s[50] - 0.004), IsNan());
  EXPECT_THAT(volume.at(ramp.time_s[50] + 0.004), IsNan());
  EXPECT_THAT(volume.at(ramp.time_s.back() + 0.01), IsNan());
  EXPECT_EQ(volume.at(1), 0);
  StreamRows none;
  none.values["commanded_mL"] = {};
  EXPECT_THAT(CommandedVolume(none).at(1), IsNan());
}

}  // namespace
}  // namespace diastole::runfile
