#pragma once
// A sound study of the gel phantom without data: what more is written behind it belongs to [data].

namespace diastole::test {

inline constexpr const char* gel_study = R"(format = "diastole-study"
version = 1
[specimen]
kind = "annulus"
inner_radius_mm = 22.5
outer_radius_mm = 50.0
height_mm = 85.0
mesh = [8, 4, 1]
ends = "fixed"
[law]
name = "neo-hookean"
[law.parameters.C1_kPa]
start = 6.5
bounds = [1.0, 15.0]
vary = "whole"
[data]
)";

}  // namespace diastole::test
