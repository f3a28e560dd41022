#pragma once
// The R-wave on the DAC without software in its path: the TTL's compare event (TIM2 TRGO) starts TIM4, whose
// update every 100 µs moves the next code to the output, and DMA brings the one after.

namespace diastole::stm32 {

class RWavePlayer {
 public:
  void start();
  /// The next rise of the TTL starts the wave.
  void arm();
  /// A rise of the TTL starts nothing; a wave that is being played goes on to its end.
  void disarm();
  /// DMA1 stream 5: the wave is over.
  void interrupt();
};

}  // namespace diastole::stm32
