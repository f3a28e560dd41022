// The full form of test_shape.cpp: other sizes of five hidden effects, by gated volumes and by pressure, each with noise of its own.

#include "tests/tools/diastole/shape_loop.hpp"

namespace diastole::shaping {
namespace {

constexpr FiveEffects rigs[] = {
    {},
    {.wave_speed_m_s = 110.0, .gas_mL = 3.0, .leak_mL_s_kPa = 0.03, .backlash_mL = 0.45, .gain = 0.07},
    {.wave_speed_m_s = 75.0, .gas_mL = 15.7, .leak_mL_s_kPa = 0.03, .backlash_mL = 0.11, .gain = 0.04},
    {.wave_speed_m_s = 45.0, .gas_mL = 15.0, .leak_mL_s_kPa = 0.1, .backlash_mL = 0.15, .gain = 0.04},
};

class ShapeInFull : public testing::TestWithParam<size_t> {};

TEST_P(ShapeInFull, GatedVolumesTeachTheDriveWithFiveHiddenEffects) {
  PlantForShape rig(with_effects(rigs[GetParam()], 1 + GetParam()), plan);
  expect_followed(learned(rig, ventricle(), 4, 0.1));
}

TEST_P(ShapeInFull, PressureTeachesTheDriveWithFiveHiddenEffects) {
  PlantForShape rig(with_effects(rigs[GetParam()], 11 + GetParam()), plan);
  expect_followed(learned(rig, ventricle(), 4));
}

INSTANTIATE_TEST_SUITE_P(Rigs, ShapeInFull, testing::Range(size_t{0}, std::size(rigs)));

}  // namespace
}  // namespace diastole::shaping
