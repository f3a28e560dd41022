#include "protocol/signal/low_pass.hpp"

#include <cmath>
#include <numbers>

namespace diastole::signal {
namespace {

using std::numbers::pi;

/// tan(pi f_c / f_s), widened for two passes.
double warped_cutoff(const LowPassDesign& design) {
  const double K = std::tan(pi * design.cutoff_Hz / design.rate_Hz);
  if (design.passes == Passes::forward) return K;
  return K / std::pow(std::numbers::sqrt2 - 1, 0.5 / design.order);
}

}  // namespace

std::vector<Biquad> butterworth(const LowPassDesign& design) {
  const double K = warped_cutoff(design);
  std::vector<Biquad> sections;
  for (int k = 1; k <= design.order / 2; ++k) {
    const double d = 2 * std::sin(pi * (2 * k - 1) / (2 * design.order));
    const double D = 1 + d * K + K * K;
    const double b0 = K * K / D;
    sections.push_back({b0, 2 * b0, b0, 2 * (K * K - 1) / D, (1 - d * K + K * K) / D});
  }
  return sections;
}

double amplitude_at(const LowPassDesign& design, double frequency_Hz) {
  const double ratio = std::tan(pi * frequency_Hz / design.rate_Hz) / warped_cutoff(design);
  const double one_pass = 1 / std::sqrt(1 + std::pow(ratio, 2 * design.order));
  return design.passes == Passes::forward ? one_pass : one_pass * one_pass;
}

LowPass::LowPass(const LowPassDesign& design) {
  for (const Biquad& biquad : butterworth(design)) {
    sections_.push_back({biquad});
    // -d(phase)/d(omega) at 0 of B/A is (sum k b_k) / (sum b_k) - (sum k a_k) / (sum a_k).
    const double numerator = (biquad.b1 + 2 * biquad.b2) / (biquad.b0 + biquad.b1 + biquad.b2);
    const double denominator = (biquad.a1 + 2 * biquad.a2) / (1 + biquad.a1 + biquad.a2);
    delay_s_ += (numerator - denominator) / design.rate_Hz;
  }
}

void LowPass::settle_at(double value) {
  for (Section& section : sections_) {
    section.z1 = (1 - section.biquad.b0) * value;
    section.z2 = (section.biquad.b2 - section.biquad.a2) * value;
  }
}

double LowPass::push(double value) {
  if (std::isnan(value)) {
    settled_ = false;
    return value;
  }
  if (!settled_) settle_at(value);
  settled_ = true;
  for (Section& section : sections_) {
    const Biquad& q = section.biquad;
    const double filtered = q.b0 * value + section.z1;
    section.z1 = q.b1 * value - q.a1 * filtered + section.z2;
    section.z2 = q.b2 * value - q.a2 * filtered;
    value = filtered;
  }
  return value;
}

}  // namespace diastole::signal
