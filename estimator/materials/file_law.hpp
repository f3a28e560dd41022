#pragma once
// A material law as a text file, NAME.law.toml (docs/effects-as-files.md): its energy in invariants and strains, read as a
// formula with units. Stress and tangent are programs made of the energy's derivatives, which dual numbers check.
//
//   I1 I2 I3              invariants of C
//   Cff Css Cnn Cfs Csn Cnf, Eff ...   C and E = (C - I)/2 in fibre, sheet, normal; r stands for n (the paper's Eq. 5)
//   I4f I4s I4n I8fs I8sn I8nf         the same as Cff, Css, ...
//   lambda_f              stretch along the fibre
//
// A law whose energy reads more than the invariants needs axes, whatever the values of its parameters.

#include <filesystem>
#include <memory>
#include <string_view>

#include "estimator/materials/law.hpp"

namespace diastole {

/// Throws InputError with file, line, column, what is wrong and what to change: also where the law, its stress or its tangent is
/// not finite at rest, its stress there is no pressure, or a small distortion needs no energy.
std::unique_ptr<const Law> read_law_file(const std::filesystem::path& path);
std::unique_ptr<const Law> read_law_text(std::string_view text, std::string name);

/// The law of a file, read once; it lives as long as the program. Thread-safe.
const Law& law_of_file(const std::filesystem::path& path);

}  // namespace diastole
