#pragma once
// The low-pass of the pressure signal: Butterworth, of even order, as a cascade of biquads.
//
// Analogue prototype of order n with cutoff wc: |H(w)|^2 = 1 / (1 + (w/wc)^(2n)), made of n/2 sections
//   wc^2 / (s^2 + d_k wc s + wc^2),   d_k = 2 sin(pi (2k - 1) / (2n)),   k = 1 ... n/2.
// The bilinear transform with K = tan(pi f_c / f_s), which brings the cutoff exactly to f_c, gives section k
//   D = 1 + d_k K + K^2,  b0 = b2 = K^2 / D,  b1 = 2 b0,  a1 = 2 (K^2 - 1) / D,  a2 = (1 - d_k K + K^2) / D,
//   y_i = b0 x_i + b1 x_(i-1) + b2 x_(i-2) - a1 y_(i-1) - a2 y_(i-2),
// and the whole filter the response |H(f)|^2 = 1 / (1 + (tan(pi f / f_s) / K)^(2n)).
//
// In the run file the signal is filtered forward and backward: no lag at any frequency, and the response
// squared. For it to be -3 dB at f_c all the same, each pass is designed with K / (sqrt 2 - 1)^(1/(2n)).
// The live view filters forward only and so lags; its lag at low frequency is LowPass::delay_s.

#include <vector>

namespace diastole::signal {

/// The frequency above which the paper's pressure signal was filtered.
inline constexpr double pressure_cutoff_Hz = 30;
inline constexpr int pressure_order = 4;
/// A signal sampled slower than this many times the cutoff cannot be low-passed there.
inline constexpr double least_rate_over_cutoff = 2.5;

enum class Passes { forward, forward_and_backward };

struct LowPassDesign {
  double cutoff_Hz = pressure_cutoff_Hz;  ///< -3 dB of all passes together
  double rate_Hz = 300;                   ///< of the samples; at least least_rate_over_cutoff x cutoff_Hz
  int order = pressure_order;             ///< of one pass, even
  Passes passes = Passes::forward;
};

struct Biquad {
  double b0 = 1, b1 = 0, b2 = 0;  ///< of x_i, x_(i-1), x_(i-2)
  double a1 = 0, a2 = 0;          ///< of y_(i-1), y_(i-2)
};

/// Sections k = 1 ... order/2 of one pass. Precondition: the design's bounds hold.
std::vector<Biquad> butterworth(const LowPassDesign& design);

/// Amplitude of all passes together at a frequency, from the formula above.
double amplitude_at(const LowPassDesign& design, double frequency_Hz);

/// Forward filter for a signal that comes sample by sample. It begins in the steady state of the first value,
/// so that there is no start-up transient; NaN (a missing sample) gives NaN, and begins anew after it.
class LowPass {
 public:
  explicit LowPass(const LowPassDesign& design);
  double push(double value);

  /// Lag of slow signals (group delay at frequency 0).
  [[nodiscard]] double delay_s() const { return delay_s_; }

 private:
  struct Section {
    Biquad biquad;
    double z1 = 0, z2 = 0;  // transposed direct form II
  };
  void settle_at(double value);

  std::vector<Section> sections_;
  double delay_s_ = 0;
  bool settled_ = false;
};

}  // namespace diastole::signal
