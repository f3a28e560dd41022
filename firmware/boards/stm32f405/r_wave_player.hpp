#pragma once
// The R-wave on the DAC without software in its path: the TTL's compare event (TIM2 TRGO) starts TIM4, whose
// update moves the next code to the output, and DMA brings the one after.

#include <array>
#include <cstdint>

#include "firmware/core/r_wave.hpp"

namespace diastole::stm32 {

class RWavePlayer {
 public:
  void start();
  /// Height and length from the next wave on. Precondition: none is being played.
  void use(const firmware::SignalSettings& signals);
  /// The next rise of the TTL starts the wave.
  void arm();
  /// A rise of the TTL starts nothing; a wave that is being played goes on to its end.
  void disarm();
  /// As arm(), but the wave begins with this code.
  void arm_with(std::uint16_t first_code);
  /// The output goes to this code and stays there, wave or not; arm() and the next wave begin as ever.
  void hold(std::uint16_t code);
  /// DMA1 stream 5: the wave is over.
  void interrupt();

 private:
  /// The DAC holds one code in advance, so the transfer that ends the wave brings one 0 more. Words, as the DAC takes nothing
  /// narrower (RM0090 14.5).
  std::array<std::uint32_t, firmware::kRWaveSamples + 1> codes_{};
  std::uint32_t reload_ = 0;  ///< of TIM4
};

}  // namespace diastole::stm32
