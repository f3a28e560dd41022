#pragma once
// The analog-to-digital converter ADC1, for measurements at rest: one channel, one conversion, polled (RM0090 13).
// 21 MHz (APB2 / 4; at most 36, datasheet), 12 bits. Its full scale is the supply.

#include <cstdint>

namespace diastole::stm32 {

/// Of SMPR. A source of 15 kOhm, the DAC without its buffer, is followed to half a code from 28 cycles on (1.9 us a
/// conversion); 480 suffice for 0.5 MOhm (24 us).
enum class SamplingTime : std::uint32_t { cycles_28 = 2, cycles_480 = 7 };

/// VREFINT: 1.18 to 1.24 V from chip to chip and over temperature; wants 10 us of sampling.
inline constexpr unsigned kReferenceInput = 17;

/// The converter has its clock and is on while one of these lives; its registers are as after reset then.
class Converter {
 public:
  enum class Reference : std::uint8_t { off, on };

  /// Waits 12 us, in which converter and reference come up (3 and 10 us at most).
  explicit Converter(Reference reference = Reference::off);
  ~Converter();
  Converter(const Converter&) = delete;
  Converter& operator=(const Converter&) = delete;
};

/// The code, 0 to 4095. Precondition: a Converter lives.
std::uint32_t convert(unsigned channel, SamplingTime sampling);

}  // namespace diastole::stm32
