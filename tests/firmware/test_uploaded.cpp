// Uploaded waveforms: the curve through their points, its peaks, its crossings, and what is refused.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "firmware/core/uploaded/crossings.hpp"
#include "firmware/core/uploaded/knot_cubic.hpp"
#include "firmware/core/uploaded/waveform_store.hpp"
#include "tests/firmware/uploaded_waveform.hpp"
#include "tests/firmware/uploads.hpp"

namespace diastole::firmware {
namespace {

using Real = long double;
using wire::Refusal;
using Rises = std::vector<std::int16_t>;

/// Up and down at random, never below the first point, and back.
Rises random_rises(std::mt19937& random, std::size_t count, std::int32_t most) {
  Rises rises;
  std::int32_t height = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto left = static_cast<std::int32_t>(count - 1 - i);
    const std::int32_t lowest = std::max(-most, -height), highest = std::min(most, left * most - height);
    std::int32_t rise = std::uniform_int_distribution(lowest, std::max(lowest, highest))(random);
    if (left > 0 && random() % 4 == 0) rise = std::clamp(0, lowest, highest);
    if (left == 0) rise = -height;
    height += rise;
    rises.push_back(static_cast<std::int16_t>(rise));
  }
  return rises;
}

Real phase_of(Q64 phase) { return static_cast<Real>(phase) / kOne; }

TEST(KnotCubic, ThreePointsOnAParabolaGiveTheParabola) {
  // y = i²: rises 1, 3, 5. Between i = 1 and 2: 2y = 2 (1 + u)² - 2.
  const KnotCubic curve = KnotCubic::between(100, 300, 500);
  EXPECT_EQ(curve.linear, 400);
  EXPECT_EQ(curve.square, 200);
  EXPECT_EQ(curve.cube, 0);
  EXPECT_EQ(curve.steepest(), 800);
  EXPECT_EQ(curve.hardest(), 400);
}

TEST(KnotCubic, AFallingIntervalIsTheRisingOneTurnedOver) {
  const KnotCubic up = KnotCubic::between(7, 300, -20), down = KnotCubic::between(-7, -300, 20);
  EXPECT_EQ(up.linear, down.linear);
  EXPECT_EQ(up.square, down.square);
  EXPECT_EQ(up.cube, down.cube);
  EXPECT_EQ(up.linear + up.square + up.cube, 600);
}

TEST(KnotCubic, NeverTurnsWithinAnInterval) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 20'000; ++trial) {
    const auto draw = [&] { return static_cast<std::int32_t>(random() % 65'535) - 32'767; };
    const KnotCubic curve = KnotCubic::between(draw(), 1 + std::abs(draw()) % 32'767, draw());
    for (int i = 0; i <= 64; ++i) {
      const double u = i / 64.0;
      ASSERT_GE(curve.linear + 2 * curve.square * u + 3 * curve.cube * u * u, -1e-6);
    }
  }
}

TEST(Uploaded, DeclaredPeaksAreThoseOfTheCurve) {
  std::mt19937 random(5);
  std::vector<Rises> waveforms{Rises(kHeartRises.begin(), kHeartRises.end())};
  for (int i = 0; i < 20; ++i)
    waveforms.push_back(random_rises(random, 5 + 3 * static_cast<std::size_t>(i), 30'000));
  for (const Rises& rises : waveforms) {
    const auto waveform = make_waveform(rises);
    if (!waveform.ok()) continue;
    const auto points = static_cast<Real>(rises.size());
    Real fastest = 0, hardest = 0;
    constexpr int kParts = 64;
    for (std::size_t i = 0; i < rises.size() * kParts; ++i) {
      // Thirds of a part, so that no difference reaches over a point.
      const Real h = 1 / (points * kParts * 3), phase = (static_cast<Real>(i) + 0.5L) / (points * kParts);
      const Real a = uploaded_volume(rises, phase - h), b = uploaded_volume(rises, phase),
                 c = uploaded_volume(rises, phase + h);
      fastest = std::max(fastest, std::abs(c - a) / (2 * h));
      hardest = std::max(hardest, std::abs(a - 2 * b + c) / (h * h));
    }
    const auto speed = static_cast<double>(fastest), acceleration = static_cast<double>(hardest);
    EXPECT_LE(speed, 1e-6 * waveform->peak_speed_millionths * 1.0001);
    EXPECT_GE(speed, 1e-6 * waveform->peak_speed_millionths * 0.99);
    EXPECT_LE(acceleration, 1e-6 * waveform->peak_acceleration_millionths * 1.0001);
    EXPECT_GE(acceleration, 1e-6 * waveform->peak_acceleration_millionths * 0.96);
  }
}

/// Every crossing lies where the curve has that level, in order, and the position stays the curve rounded to a
/// microstep but for the eighth that is let go at a turn.
void expect_crossings(const Rises& rises, std::uint32_t levels) {
  const auto waveform = make_waveform(rises);
  ASSERT_TRUE(waveform.ok());
  std::int64_t position = 0;
  Real before = -1;
  std::size_t crossings = 0;
  for (UploadedCrossings next(*waveform, levels); !next.at_end(); ++crossings) {
    const auto [phase, rising] = next.take();
    const Real at = phase_of(phase);
    ASSERT_GT(at, before);
    const Real middle = (before < 0 ? at : before + at) / 2;
    const Real error =
        uploaded_volume(rises, middle) * static_cast<Real>(levels) - static_cast<Real>(position);
    ASSERT_LE(std::abs(error), 0.6251L) << "at " << middle;
    before = at;
    const std::int64_t level = rising ? position : position - 1;
    const Real wanted = (2 * static_cast<Real>(level) + 1) / (2 * static_cast<Real>(levels));
    const auto off = static_cast<double>(uploaded_volume(rises, at) - wanted);
    // What was let go at one turn is made good at the next.
    const Real points = at * static_cast<Real>(rises.size());
    const bool at_turn = std::abs(points - std::round(points)) < 1e-9L;
    ASSERT_NEAR(off, 0, at_turn ? 0.1251 / levels : 2e-12) << crossings;
    position += rising ? 1 : -1;
    ASSERT_GE(position, 0);
    ASSERT_LE(position, levels);
  }
  EXPECT_EQ(position, 0);
  EXPECT_GE(crossings, 2 * levels);
}

TEST(Uploaded, CrossesEveryLevelWhereTheCurveDoes) {
  for (const std::uint32_t levels : {1U, 2U, 3U, 257U, 5134U, 100'003U})
    ASSERT_NO_FATAL_FAILURE(expect_crossings({kHeartRises.begin(), kHeartRises.end()}, levels));
}

TEST(Uploaded, MayRiseAndFallAsOftenAsItLikes) {
  std::mt19937 random(11);
  for (int trial = 0; trial < 300; ++trial) {
    SCOPED_TRACE(trial);
    const std::size_t points = 2 + random() % 200;
    const Rises rises = random_rises(random, points, trial % 3 == 0 ? 3 : 32'767);
    if (!make_waveform(rises).ok()) continue;
    ASSERT_NO_FATAL_FAILURE(
        expect_crossings(rises, 1 + static_cast<std::uint32_t>(random() % (trial % 2 == 0 ? 20U : 3'000U))));
  }
}

/// (1 - cos 2πphase) / 2, the largest rise nearly filling its 16 bits.
Rises sine(int points) {
  Rises rises;
  std::int32_t before = 0;
  for (int i = 1; i <= points; ++i) {
    const double phase = static_cast<double>(i) / points;
    const auto height =
        static_cast<std::int32_t>(std::lround(5000.0 * points * (1 - std::cos(2 * M_PI * phase))));
    rises.push_back(static_cast<std::int16_t>(height - before));
    before = height;
  }
  return rises;
}

TEST(Uploaded, TheFullTableRunsToo) {
  const Rises rises = sine(4096);
  const auto waveform = make_waveform(rises);
  ASSERT_TRUE(waveform.ok());
  EXPECT_NEAR(1e-6 * waveform->peak_speed_millionths, M_PI, 1e-3);
  EXPECT_NEAR(1e-6 * waveform->peak_acceleration_millionths, 2 * M_PI * M_PI, 2) << "rounding";
  UploadedCrossings next(*waveform, 5134);
  for (std::uint32_t k = 0; k < 2 * 5134; ++k) {
    const std::uint32_t level = k < 5134 ? k : 2 * 5134 - 1 - k;
    const Real y = (2 * level + 1) / (2.0L * 5134);
    const Real up = std::acos(1 - 2 * y) / (2 * std::numbers::pi_v<Real>);
    const auto [phase, rising] = next.take();
    ASSERT_NEAR(static_cast<double>(phase_of(phase) - (k < 5134 ? up : 1 - up)), 0, 2e-6) << k;
  }
  EXPECT_TRUE(next.at_end());
}

Refusal upload(WaveformStore& store, std::uint8_t number, const Rises& rises) {
  const wire::UploadWaveform head = upload_of(number, rises);
  Refusal refusal = store.begin(head.waveform, head.points, head.crc);
  for (std::size_t first = 0; first < rises.size() && refusal == Refusal::none;
       first += wire::WaveformPoints::kMaxCount) {
    const wire::WaveformPoints lot = lot_of(rises, first);
    refusal = store.append(lot.first, std::span(lot.rise).first(lot.count));
  }
  return refusal;
}

TEST(WaveformStore, HoldsWhatWasUploaded) {
  WaveformStore store;
  const Rises heart(kHeartRises.begin(), kHeartRises.end()), triangle{100, -100};
  EXPECT_EQ(store.find(0), nullptr);
  ASSERT_EQ(upload(store, 0, heart), Refusal::none);
  ASSERT_EQ(upload(store, 1, triangle), Refusal::none);
  EXPECT_EQ(store.room(), 4096U - 50);
  ASSERT_NE(store.find(0), nullptr);
  EXPECT_EQ(Rises(store.find(0)->rises.begin(), store.find(0)->rises.end()), heart);
  EXPECT_EQ(store.find(0)->full_scale, heart_waveform().full_scale);
  EXPECT_EQ(store.find(1)->full_scale, 100);
  EXPECT_EQ(store.find(2), nullptr);
  store.clear();
  EXPECT_EQ(store.find(0), nullptr);
}

TEST(WaveformStore, TakesNothingTwiceAndNothingOutOfOrder) {
  WaveformStore store;
  const Rises rises(200, 0);
  EXPECT_EQ(store.append(0, rises), Refusal::waveform_out_of_step) << "not announced";
  EXPECT_EQ(store.begin(1, 200, 0), Refusal::waveform_out_of_step) << "0 comes first";
  ASSERT_EQ(store.begin(0, 200, 0), Refusal::none);
  ASSERT_EQ(store.append(0, std::span(rises).first(100)), Refusal::none);
  EXPECT_EQ(store.append(0, std::span(rises).first(100)), Refusal::waveform_out_of_step);
  EXPECT_EQ(store.append(100, std::span(rises).first(100)), Refusal::waveform_out_of_step) << "begin again";
  ASSERT_EQ(store.begin(0, 200, 0), Refusal::none);
  EXPECT_EQ(store.append(0, Rises(201, 0)), Refusal::waveform_out_of_step);
}

TEST(WaveformStore, EveryChangedBitIsNoticed) {
  const Rises heart(kHeartRises.begin(), kHeartRises.end());
  const wire::UploadWaveform head = upload_of(0, heart);
  for (std::size_t i = 0; i < heart.size(); ++i) {
    for (int bit = 0; bit < 16; ++bit) {
      WaveformStore store;
      Rises damaged = heart;
      damaged[i] = static_cast<std::int16_t>(damaged[i] ^ (1 << bit));
      ASSERT_EQ(store.begin(0, head.points, head.crc), Refusal::none);
      ASSERT_EQ(store.append(0, damaged), Refusal::waveform_damaged);
      ASSERT_EQ(store.find(0), nullptr);
    }
  }
}

TEST(WaveformStore, RefusesWhatIsNoCycle) {
  WaveformStore store;
  EXPECT_EQ(upload(store, 0, {100, -99}), Refusal::waveform_unfit) << "not closed";
  EXPECT_EQ(upload(store, 0, {-100, 100}), Refusal::waveform_unfit) << "below its beginning";
  EXPECT_EQ(upload(store, 0, {0, 0, 0}), Refusal::waveform_unfit) << "never moves";
  Rises steep(4096, 0);
  steep[10] = 32'767;
  steep[11] = -32'767;
  EXPECT_EQ(upload(store, 0, steep), Refusal::waveform_unfit) << "too steep";
  EXPECT_EQ(upload(store, 0, {100, -100}), Refusal::none);
}

TEST(WaveformStore, SaysWhenItIsFull) {
  WaveformStore store;
  EXPECT_EQ(store.begin(0, 4096, 0), Refusal::none);
  ASSERT_EQ(upload(store, 0, sine(4090)), Refusal::none);
  EXPECT_EQ(upload(store, 1, {1, 1, 1, 1, -1, -1, -2}), Refusal::waveforms_full);
  ASSERT_EQ(upload(store, 1, {1, 1, 1, -1, -1, -1}), Refusal::none);
  EXPECT_EQ(upload(store, 2, {1, -1}), Refusal::waveforms_full);
  store.clear();
  for (std::uint8_t i = 0; i < 8; ++i)
    ASSERT_EQ(upload(store, i, {1, -1}), Refusal::none);
  EXPECT_EQ(upload(store, 8, {1, -1}), Refusal::waveforms_full);
}

}  // namespace
}  // namespace diastole::firmware
