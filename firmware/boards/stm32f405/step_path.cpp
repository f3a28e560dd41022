#include "firmware/boards/stm32f405/step_path.hpp"

namespace diastole::firmware {

template class StepEngine<stm32::Stm32Board>;
template void StepFeed<stm32::Stm32Board>::refill(Ticks);

}  // namespace diastole::firmware
