#pragma once
// What every step goes through, in a translation unit of its own that is compiled for speed while the rest of
// the image is compiled for size: the step interrupt's engine and the refilling of its queue.

#include "firmware/boards/stm32f405/stm32_board.hpp"
#include "firmware/core/motion.hpp"

namespace diastole::firmware {

extern template class StepEngine<stm32::Stm32Board>;
extern template void StepFeed<stm32::Stm32Board>::refill(Ticks);

}  // namespace diastole::firmware
