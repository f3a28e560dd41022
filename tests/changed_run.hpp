#pragma once
// Other numbers in a run file that a test has copied, as a rig with something wrong would have recorded them.

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <vector>

#include "protocol/runfile/h5_handle.hpp"

namespace diastole::test {

/// Each number of the dataset becomes change(number, its index).
inline void change_dataset(const std::filesystem::path& run, const char* dataset,
                           const std::function<double(double, size_t)>& change) {
  std::filesystem::permissions(run, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
  const runfile::FileHandle file(H5Fopen(run.c_str(), H5F_ACC_RDWR, H5P_DEFAULT));
  const runfile::DatasetHandle data(H5Dopen2(file.get(), dataset, H5P_DEFAULT));
  ASSERT_TRUE(data.valid()) << dataset << " of " << run;
  const runfile::SpaceHandle space(H5Dget_space(data.get()));
  std::vector<double> numbers(static_cast<size_t>(H5Sget_simple_extent_npoints(space.get())));
  ASSERT_GE(H5Dread(data.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()), 0);
  for (size_t i = 0; i < numbers.size(); ++i)
    numbers[i] = change(numbers[i], i);
  ASSERT_GE(H5Dwrite(data.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers.data()), 0);
}

/// Steps that wobble by a fifth of a millilitre, ever faster, as long as the piston is out: no motion that is known follows them.
inline void wobble_steps(const std::filesystem::path& run) {
  constexpr double step_mL = 0.007791648446403256, rate_Hz = 300;  // of tests/data/rig
  change_dataset(run, "/pump/commanded_mL", [](double volume_mL, size_t i) {
    if (volume_mL <= 0) return volume_mL;
    const double wobble_mL = 0.2 * std::sin(3 * std::pow(static_cast<double>(i) / rate_Hz, 1.5));
    return step_mL * std::round((volume_mL + wobble_mL) / step_mL);
  });
}

}  // namespace diastole::test
