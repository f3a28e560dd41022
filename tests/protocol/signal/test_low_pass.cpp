// Against scipy 1.10.1 (butter, sosfilt with sosfilt_zi, sosfiltfilt), and against the formula by sines.

#include "protocol/signal/low_pass.hpp"

#include "protocol/signal/zero_phase.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tests/protocol/signal/filtered_at_once.hpp"

namespace diastole::signal {
namespace {

using std::numbers::pi;

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr LowPassDesign causal{.cutoff_Hz = 30, .rate_Hz = 300, .order = 4, .passes = Passes::forward};
constexpr LowPassDesign zero_phase{
    .cutoff_Hz = 30, .rate_Hz = 300, .order = 4, .passes = Passes::forward_and_backward};

const std::vector<double> input{0.0,    1.079, 1.833, 2.752, 2.756,  3.202,  2.29,   2.263,
                                0.605,  0.425, 0.448, 0.598, -1.215, -0.311, -1.647, 0.173,
                                -0.694, 1.869, 1.15,  4.026, 2.971,  5.677,  3.865,  6.093};
const std::vector<double> scipy_causal{0.0,
                                       0.005205466482975813,
                                       0.04199930784645843,
                                       0.167353994418655,
                                       0.44513383638540993,
                                       0.8996832485616993,
                                       1.4849719498496996,
                                       2.089166201214803,
                                       2.567515688027452,
                                       2.7858905108754293,
                                       2.6677130338700676,
                                       2.2374900962752675,
                                       1.61555359183652,
                                       0.9451336231067848,
                                       0.32564730097681466,
                                       -0.19130575102761294,
                                       -0.5723142928276256,
                                       -0.7797277410671273,
                                       -0.7691105928585188,
                                       -0.502732699475281,
                                       0.031400433263192085,
                                       0.8051378389409343,
                                       1.7464603501238916,
                                       2.747560792206602};
const std::vector<double> scipy_zero_phase{
    0.005337861871777386, 1.042644546557105,   1.9315675848088296,  2.5564160137417815,  2.8518666428641093,
    2.8131403985102184,   2.491372532554334,   1.9746247821534624,  1.3608226839932476,  0.7340049924814495,
    0.15505285554286924,  -0.3304749088529111, -0.6772482616770021, -0.8332046433283727, -0.7488042804575554,
    -0.39712666929601304, 0.2086883078813725,  1.012283335151319,   1.928370255718618,   2.8683906738650307,
    3.7660457266023633,   4.5918706396517175,  5.352518466836365,   6.079041329210744};
/// Of the first nine values, reflected over eight.
const std::vector<double> scipy_short{-0.03858432447872262, 1.0540447030425206, 2.0136380479135085,
                                      2.697007257748457,    2.9991828975139865, 2.8753981069882855,
                                      2.3562792697891908,   1.5483199484345445, 0.6127281446439372};

void expect_near(const std::vector<double>& found, const std::vector<double>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (size_t i = 0; i < found.size(); ++i)
    EXPECT_NEAR(found[i], expected[i], 1e-12) << "row " << i;
}

std::vector<double> sine(double frequency_Hz, size_t rows) {
  std::vector<double> values;
  for (size_t i = 0; i < rows; ++i)
    values.push_back(std::sin(2 * pi * frequency_Hz * static_cast<double>(i) / 300));
  return values;
}

TEST(LowPass, HasTheCoefficientsThatScipyDesigns) {
  const std::vector<Biquad> sections = butterworth(causal);
  ASSERT_EQ(sections.size(), 2U);
  EXPECT_NEAR(sections[0].a1, -1.320913430819426, 1e-14);
  EXPECT_NEAR(sections[0].a2, 0.6327387928852762, 1e-14);
  EXPECT_NEAR(sections[1].a1, -1.0485995763626117, 1e-14);
  EXPECT_NEAR(sections[1].a2, 0.2961403575616696, 1e-14);
  EXPECT_NEAR(sections[0].b0 * sections[1].b0, 0.004824343357716231, 1e-15);
}

TEST(LowPass, FiltersForwardAsScipyDoes) {
  LowPass filter(causal);
  std::vector<double> found;
  for (const double value : input)
    found.push_back(filter.push(value));
  expect_near(found, scipy_causal);
  EXPECT_NEAR(300 * filter.delay_s(), 4.021187327287858, 1e-9);
}

TEST(LowPass, FiltersForwardAndBackwardAsScipyDoes) {
  expect_near(filter_zero_phase(input, {}, zero_phase), scipy_zero_phase);
  expect_near(filter_zero_phase(std::span(input).first(9), {}, zero_phase), scipy_short);
}

TEST(LowPass, NeverReachesAcrossAMissingRowOrABreak) {
  std::vector<double> values(input.begin(), input.begin() + 9);
  values.push_back(not_a_number);
  values.insert(values.end(), input.begin(), input.end());
  values.insert(values.end(), input.begin(), input.end());
  const std::vector<size_t> breaks{10 + input.size()};
  const std::vector<double> filtered = filter_zero_phase(values, breaks, zero_phase);
  expect_near({filtered.begin(), filtered.begin() + 9}, scipy_short);
  EXPECT_TRUE(std::isnan(filtered[9]));
  expect_near({filtered.begin() + 10, filtered.begin() + 34}, scipy_zero_phase);
  expect_near({filtered.begin() + 34, filtered.end()}, scipy_zero_phase);
}

TEST(LowPass, KeepsStretchesTooShortToFilterAndEmptyOnes) {
  EXPECT_TRUE(filter_zero_phase({}, {}, zero_phase).empty());
  const std::vector<double> lone{not_a_number, 3, not_a_number};
  const std::vector<double> filtered = filter_zero_phase(lone, {}, zero_phase);
  EXPECT_NEAR(filtered[1], 3, 1e-12);
  EXPECT_TRUE(std::isnan(filtered[0]) && std::isnan(filtered[2]));
}

/// Forward and backward over the whole signal at once, continued at both ends as zero_phase.hpp says.
std::vector<double> in_one_pass(const std::vector<double>& values) {
  constexpr size_t pad = 15;
  std::vector<double> extended;
  for (size_t i = pad; i > 0; --i)
    extended.push_back(2 * values.front() - values[i]);
  extended.insert(extended.end(), values.begin(), values.end());
  for (size_t i = 1; i <= pad; ++i)
    extended.push_back(2 * values.back() - values[values.size() - 1 - i]);
  for (int pass = 0; pass < 2; ++pass) {
    LowPass filter(zero_phase);
    for (double& value : extended)
      value = filter.push(value);
    std::ranges::reverse(extended);
  }
  return {extended.begin() + pad, extended.end() - pad};
}

TEST(LowPass, GivesOutALongSignalInPartsAsItWouldFilterTheWhole) {
  for (const size_t length : {16U, 399U, 400U, 401U, 600U, 5000U}) {
    std::vector<double> values;
    for (size_t i = 0; i < length; ++i)
      values.push_back(std::sin(0.02 * static_cast<double>(i)) +
                       1e-3 * static_cast<double>(i * 2654435761U % 1000) + static_cast<double>(i / 700));
    const std::vector<double> expected = in_one_pass(values);
    size_t given = 0, pushed = 0, most_held = 0;
    ZeroPhaseFilter filter(zero_phase, [&](double value) {
      EXPECT_NEAR(value, expected[given], 1e-12) << "value " << given << " of " << length;
      ++given;
    });
    for (const double value : values) {
      filter.push(value);
      most_held = std::max(most_held, ++pushed - given);
    }
    filter.end_stretch();
    EXPECT_EQ(given, length);
    EXPECT_LE(most_held, 400U) << "two look-aheads of 20 cycles of the cutoff";
  }
}

TEST(LowPass, BeginsAnewInTheSteadyStateAfterAMissingSample) {
  LowPass filter(causal);
  for (int i = 0; i < 20; ++i)
    EXPECT_NEAR(filter.push(2), 2, 1e-12);
  EXPECT_TRUE(std::isnan(filter.push(not_a_number)));
  for (int i = 0; i < 20; ++i)
    EXPECT_NEAR(filter.push(5), 5, 1e-12);
}

class Response : public testing::TestWithParam<double> {};

TEST_P(Response, OfSinesIsThatOfTheFormulaWithoutLag) {
  const double frequency_Hz = GetParam();
  const std::vector<double> values = sine(frequency_Hz, 1500);
  const std::vector<double> filtered = filter_zero_phase(values, {}, zero_phase);
  double in_phase = 0, quadrature = 0;
  for (size_t i = 450; i < 1050; ++i) {  // whole cycles of every frequency asked
    const double phase = 2 * pi * frequency_Hz * static_cast<double>(i) / 300;
    in_phase += filtered[i] * std::sin(phase) / 300;
    quadrature += filtered[i] * std::cos(phase) / 300;
  }
  EXPECT_NEAR(in_phase, amplitude_at(zero_phase, frequency_Hz), 1e-6);
  EXPECT_NEAR(quadrature, 0, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(LowPass, Response, testing::Values(0.5, 1, 5, 10, 20, 30, 45, 60, 100));

TEST(LowPass, IsFlatInThePassBandHalvesThePowerAtTheCutoffAndStopsBeyond) {
  for (const LowPassDesign& design : {causal, zero_phase}) {
    EXPECT_GT(amplitude_at(design, 10), 0.998);
    EXPECT_NEAR(amplitude_at(design, 30), std::sqrt(0.5), 1e-12);
    EXPECT_LT(amplitude_at(design, 60), 0.05);
    EXPECT_LT(amplitude_at(design, 100), 1e-2);
  }
}

}  // namespace
}  // namespace diastole::signal
